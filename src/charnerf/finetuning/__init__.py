"""Adapting what follows the combination of the views to one character's drawings."""

from charnerf.finetuning.finetune import Finetuned, finetune
from charnerf.finetuning.recipe import Recipe

__all__ = ["Finetuned", "Recipe", "finetune"]
