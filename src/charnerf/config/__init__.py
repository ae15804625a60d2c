"""Configs: their schema, what is wrong with one, and composing one; no other room knows of them."""

from charnerf.config.schema import MODEL_SECTIONS
from charnerf.config.validation import validate, validate_model

__all__ = ["MODEL_SECTIONS", "validate", "validate_model"]
