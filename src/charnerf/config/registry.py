"""Which class may stand where: the one list that `_target_` is held against; what is not in it is not even imported.

A slot is a section of a config (`encoder`), a value of one (`loss.depth`) or an argument of a class (`schedule.phases`) that
holds a part. Everywhere else, so in the slot of any number or text, a section with `_target_` is refused. Only classes are
listed, never functions: a function that is called while a config is read would do its work before anybody could check it.
"""

from collections.abc import Mapping

MODELS = "charnerf.models"
QUADRATURE, RENDERERS = "charnerf.volume.quadrature", "charnerf.volume.renderers"
LOSSES, AUGMENTATION = "charnerf.losses", "charnerf.data.augmentation"
LIGHTNING = "lightning.pytorch"

GROUPS: Mapping[str, tuple[str, ...]] = {
    "encoder": (
        f"{MODELS}.encoders.double.DoubleHourglass",
        f"{MODELS}.encoders.resnet34.ResNet34",
        f"{MODELS}.encoders.single.SingleHourglass",
    ),
    "single_view": (
        f"{MODELS}.single_view.camera.CameraSingleView",
        f"{MODELS}.single_view.world.WorldSingleView",
    ),
    "combinator": (
        f"{MODELS}.combinators.learned.LearnedWeights",
        f"{MODELS}.combinators.mean.Mean",
        f"{MODELS}.combinators.self_attention.SelfAttention",
        f"{MODELS}.combinators.view_attention.ViewAttention",
    ),
    "head": (f"{MODELS}.heads.blend.BlendHead", f"{MODELS}.heads.radiance.RadianceHead"),
    "density": (
        f"{MODELS}.density.view_dependent.ViewDependentDensity",
        f"{MODELS}.density.view_free.ViewFreeDensity",
        f"{MODELS}.density.view_in_f1.ViewInF1Density",
    ),
    "views": (
        f"{MODELS}.views.first.FirstViews",
        f"{MODELS}.views.mirrored.MirroredSide",
        f"{MODELS}.views.turnaround.Turnaround",
    ),
    "features": (
        f"{MODELS}.features.image.ImageFeatures",
        f"{MODELS}.features.image_hull.ImageHullFeatures",
        f"{MODELS}.features.image_hull_section.ImageHullSectionFeatures",
        f"{MODELS}.features.image_hull_section_consistency.ImageHullSectionConsistencyFeatures",
    ),
    "activation": tuple(
        f"{MODELS}.activations.{name}" for name in ("ReLU", "ShiftedSoftplus", "TruncatedExp")
    ),
    "quadrature": (
        f"{QUADRATURE}.PiecewiseConstant",
        f"{QUADRATURE}.PiecewiseLinear",
        f"{QUADRATURE}.guided.DepthGuided",
    ),
    "renderer": (
        f"{RENDERERS}.adaptive.AdaptiveRenderer",
        f"{RENDERERS}.baked.BakedRenderer",
        f"{RENDERERS}.culled.CulledRenderer",
        f"{RENDERERS}.dense.DenseRenderer",
    ),
    "loss": (
        f"{LOSSES}.depth.Depth",
        f"{LOSSES}.occupancy.Occupancy",
        f"{LOSSES}.perceptual.Perceptual",
        f"{LOSSES}.opacity.Opacity",
        f"{LOSSES}.reconstruction.Reconstruction",
        f"{LOSSES}.surface.Surface",
    ),
    "surface_dirs": tuple(
        f"{LOSSES}.directions.{name}" for name in ("CameraDirections", "NoDirections", "RandomDirections")
    ),
    "space": ("charnerf.data.silhouettes.SilhouetteSpace", "charnerf.data.space.SolidSpace"),
    "surface": ("charnerf.data.surface.AreaSurface", "charnerf.data.surface.VisibleSurface"),
    "augmentation": (
        f"{AUGMENTATION}.drawing.Drawing",
        f"{AUGMENTATION}.mirror.Mirror",
        f"{AUGMENTATION}.recolor.Recolor",
        f"{AUGMENTATION}.stretch.Stretch",
    ),
    "schedule": ("charnerf.schedule.PhaseSchedule",),
    "phase": ("charnerf.schedule.Phase",),
    "data": (
        "charnerf.capture.joined_data.JoinedData",
        "charnerf.capture.people_data.PeopleData",
        "charnerf.capture.procedural_data.ProceduralData",
        "charnerf.capture.shapes_data.ShapesData",
        "charnerf.data.folder.FolderData",
        "charnerf.data.shards_data.ShardsData",
        "charnerf.foreign.data.ForeignData",
    ),
    "optimizer": (
        "charnerf.training.muon.MuonWithAdam",
        *(
            f"torch.optim.{name}"
            for name in (
                *("Adadelta", "Adafactor", "Adagrad", "Adam", "AdamW", "Adamax", "ASGD"),
                *("NAdam", "RAdam", "RMSprop", "Rprop", "SGD"),
            )
        ),
    ),
    "trainer": ("lightning.Trainer",),
    "profiler": (f"{LIGHTNING}.profilers.PyTorchProfiler", f"{LIGHTNING}.profilers.SimpleProfiler"),
    "strategy": (f"{LIGHTNING}.strategies.DDPStrategy", f"{LIGHTNING}.strategies.FSDPStrategy"),
    "plugin": (f"{LIGHTNING}.plugins.environments.SLURMEnvironment",),
}

ARGUMENTS: Mapping[str, Mapping[str, str]] = {  # groups of the arguments that are parts, by class
    "charnerf.losses.surface.Surface": {"directions": "surface_dirs"},
    "charnerf.schedule.PhaseSchedule": {"phases": "phase"},
    "lightning.Trainer": {"profiler": "profiler", "strategy": "strategy", "plugins": "plugin"},
}

# groups whose options say `_partial_`: a run brings what it reads
COMPLETED_LATER = ("optimizer", "space", "surface")
