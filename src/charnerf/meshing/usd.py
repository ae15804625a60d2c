"""USDZ by Pixar's library: one mesh with a preview surface, Y up, metres."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from charnerf.errors import DataError, DependencyError
from charnerf.meshing.exported import ExportedMesh
from charnerf.surfaces.color import linear_from_srgb
from charnerf.wording import install_words


def check_usd() -> None:
    """Check that USDZ can be written.

    Raises:
        DependencyError: If Pixar's library is missing.
    """
    try:
        from pxr import Usd  # noqa: F401
    except ImportError as error:
        raise DependencyError(
            f".usdz: Pixar's library is missing ({error}). {install_words('usd')} Or choose .glb."
        ) from error


def encode_usdz(exported: ExportedMesh) -> bytes:
    """One mesh as a USDZ package, its picture inside.

    Raises:
        DependencyError: If Pixar's library is missing.
        DataError: If the package could not be made.
    """
    check_usd()
    from pxr import Sdf, Usd, UsdUtils

    with tempfile.TemporaryDirectory() as folder:
        layer = Path(folder) / "mesh.usdc"
        stage = Usd.Stage.CreateNew(str(layer))
        _fill(stage, exported)
        if exported.picture is not None:
            (Path(folder) / "base_color.png").write_bytes(exported.png())
        stage.GetRootLayer().Save()
        package = Path(folder) / "mesh.usdz"
        if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(layer)), str(package)):
            raise DataError(f"{exported.name}.usdz: the package could not be made; choose .glb.")
        return package.read_bytes()


def _fill(stage: Any, exported: ExportedMesh) -> None:
    """Set the scene up."""
    from pxr import Usd, UsdGeom, UsdShade, Vt

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, "/Character")
    Usd.ModelAPI(root).SetKind("component")
    root.GetPrim().SetDisplayName(exported.name)
    stage.SetDefaultPrim(root.GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/Character/Mesh")
    points = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(exported.vertices, np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(exported.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(exported.faces.astype(np.int32).reshape(-1)))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(exported.normals, np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    material = _material(stage, mesh, exported)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _material(stage: Any, mesh: Any, exported: ExportedMesh) -> Any:
    """A rough, non-metallic material in the mesh's colours."""
    from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

    types, values = Sdf.ValueTypeNames, UsdGeom.PrimvarsAPI(mesh)
    material = UsdShade.Material.Define(stage, "/Character/Material")
    surface = UsdShade.Shader.Define(stage, "/Character/Material/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", types.Float).Set(1.0)
    surface.CreateInput("metallic", types.Float).Set(0.0)
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    diffuse = surface.CreateInput("diffuseColor", types.Color3f)
    reader = UsdShade.Shader.Define(stage, "/Character/Material/Reader")
    if exported.uv is not None:
        uv = Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(exported.uv, np.float32))
        values.CreatePrimvar("st", types.TexCoord2fArray, UsdGeom.Tokens.vertex).Set(uv)
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", types.String).Set("st")
        picture = UsdShade.Shader.Define(stage, "/Character/Material/Picture")
        picture.CreateIdAttr("UsdUVTexture")
        picture.CreateInput("file", types.Asset).Set("./base_color.png")
        picture.CreateInput("sourceColorSpace", types.Token).Set("sRGB")
        for side in ("wrapS", "wrapT"):
            picture.CreateInput(side, types.Token).Set("clamp")
        coordinates = reader.CreateOutput("result", types.Float2)
        picture.CreateInput("st", types.Float2).ConnectToSource(coordinates)
        diffuse.ConnectToSource(picture.CreateOutput("rgb", types.Float3))
    elif exported.rgba is not None:
        linear = np.ascontiguousarray(linear_from_srgb(exported.rgba[:, :3]), np.float32)
        colors = values.CreatePrimvar("displayColor", types.Color3fArray, UsdGeom.Tokens.vertex)
        colors.Set(Vt.Vec3fArray.FromNumpy(linear))
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", types.String).Set("displayColor")
        diffuse.ConnectToSource(reader.CreateOutput("result", types.Float3))
    else:
        stage.RemovePrim(reader.GetPath())
        diffuse.Set(Gf.Vec3f(0.5, 0.5, 0.5))
    return material
