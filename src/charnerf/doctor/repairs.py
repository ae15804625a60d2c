"""Commands that mend files in place, to be typed by who has looked at the evidence."""

from pathlib import Path
from shlex import quote

_SCRIPT = (
    "import json,sys,numpy as n; f=sys.argv[1]; c=json.load(open(f)); "
    "[x.update(transform_matrix=({change}).tolist()) for x in [*c['frames'],*c.get('source_views',{{}}).values()] "
    "for m in [n.array(x['transform_matrix'])]]; json.dump(c,open(f,'w'),indent=1)"
)
_CHANGES = {
    "row for column": "m.T if m[3].tolist()!=[0,0,0,1] else m",
    "scaled axes": "n.hstack((n.vstack((m[:3,:3]/n.cbrt(n.linalg.det(m[:3,:3])),m[3:,:3])),m[:,3:]))",
    "opencv": "m@n.diag([1,-1,-1,1])",
    "inverse": "n.linalg.inv(m)",
    "inverse opencv": "n.linalg.inv(m)@n.diag([1,-1,-1,1])",
    "transposed rotations": "n.vstack((n.hstack((m[:3,:3].T,m[:3,3:])),m[3:]))",
}
_ANGLES = (
    "import json,sys,math; f=sys.argv[1]; c=json.load(open(f)); "
    "[x.update({k:math.radians(x[k])}) for x in [c,*c['frames']] for k in ('camera_angle_x','camera_angle_y') "
    "if x.get(k,0)>math.pi]; json.dump(c,open(f,'w'),indent=1)"
)


def pose_command(kind: str, path: Path | None) -> str:
    """What changes all poses, or angles, of a transforms.json; empty where nothing general does."""
    if path is None:
        return ""
    if kind == "degrees for radians":
        return f'python -c "{_ANGLES}" {quote(str(path))}'
    change = _CHANGES.get(kind)
    return f'python -c "{_SCRIPT.format(change=change)}" {quote(str(path))}' if change else ""


def mirror_command(picture: Path) -> str:
    """What flips a picture left to right."""
    return (
        'python -c "import sys; from PIL import Image,ImageOps; f=sys.argv[1]; ImageOps.mirror(Image.open(f)).save(f)" '
        + quote(str(picture))
    )


def rgba_command(picture: Path) -> str:
    """What writes a picture as 8-bit sRGB."""
    return (
        'python -c "import sys,io; from PIL import Image,ImageCms; f=sys.argv[1]; i=Image.open(f); '
        "p=i.info.get('icc_profile'); "
        "i=ImageCms.profileToProfile(i,ImageCms.ImageCmsProfile(io.BytesIO(p)),ImageCms.createProfile('sRGB')) if p else i; "
        "i=i.convert('RGBA'); i.info.clear(); i.save(f)\" " + quote(str(picture))
    )
