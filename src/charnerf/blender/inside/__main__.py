"""One job inside Blender: `python -m charnerf.blender.inside.__main__ JOB.json`, or `blender --python THIS -- JOB.json`."""

import json
import sys
from pathlib import Path


def main() -> None:
    """Do the job that the last argument names; the answer is written beside it."""
    job_file = Path(sys.argv[-1])
    # Blender's own Python does not know charnerf; what comes with Blender stays first
    sys.path.append(str(Path(__file__).resolve().parents[3]))
    from charnerf.blender.inside.ending import end_with_parent
    from charnerf.blender.inside.pictures import take_pictures
    from charnerf.blender.inside.reading import read_character
    from charnerf.blender.inside.refusal import Refused

    job = json.loads(job_file.read_text(encoding="utf-8"))
    end_with_parent(job["parent"])
    work = {"read": read_character, "pictures": take_pictures}[job["do"]]
    try:
        answer = work(job)
    except Refused as err:
        answer = {"error": str(err)}
    job_file.with_name("answer.json").write_text(json.dumps(answer), encoding="utf-8")


main()
