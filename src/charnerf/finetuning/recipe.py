"""How fine-tuning goes: numbers chosen by measurement on validation characters (docs/finetuning.md)."""

from dataclasses import dataclass

from charnerf.errors import ConfigError


@dataclass(frozen=True)
class Recipe:
    """Settings of fine-tuning.

    Attributes:
        seconds: Time for everything, the preparation included, s.
        learning_rate: At the start; a cosine brings it to a twentieth.
        rays: Source rays of a step.
        novel_rays: Rays of a step seen from elsewhere, whose targets are the starting weights' answers.
        trust: Weight of these targets, where the start is opaque.
        opacity: Weight of the rays' opacity against the mask.
        clip: Bound on the gradient's norm.
        held_out: Share of the drawings' patches that nothing is learnt from.
        patches: Patches along a drawing's side.
        check_every: Steps between two looks at the held-out patches.
        patience: Looks without improvement after which it ends.
        least_likeness: PSNR to the starting weights in novel views below which weights are not kept, dB.
        most_steps: Bound on the steps.
        memory_mib: Bound on what is kept of the samples, MiB; rays above it are left out.
        seed: Of patches, rays and jitter.
    """

    seconds: float = 30.0
    learning_rate: float = 1e-3
    rays: int = 256
    novel_rays: int = 128
    trust: float = 1.0
    opacity: float = 0.3
    clip: float = 1.0
    held_out: float = 0.2
    patches: int = 16
    check_every: int = 20
    patience: int = 3
    least_likeness: float = 28.0
    most_steps: int = 120
    memory_mib: float = 1024.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what can not work."""
        if not self.seconds > 0:
            raise ConfigError(f"seconds: found {self.seconds:g}, expected a positive time.")
        if not 0.0 < self.held_out < 1.0:
            raise ConfigError(
                f"held_out: found {self.held_out:g}, expected a share above 0 and below 1: what is learnt "
                "has to be checked on something else."
            )
