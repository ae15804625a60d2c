"""Train: `python train.py [group=option ...] [key=value ...]`; `-m` trains a grid and reports over it.

The same grid typed again skips its finished cells and goes on with the others. Exit status: 0 done, 1 failed, 2 wrong
call; 130 and 143 stopped by SIGINT (Ctrl-C) and SIGTERM, with a checkpoint. HYDRA_FULL_ERROR=1 shows tracebacks. It is
`charnerf train`, with the config files beside this one.
"""

import sys
from pathlib import Path

from charnerf.cli.train import main
from charnerf.interruption import leave

if __name__ == "__main__":
    leave(main(sys.argv[1:], conf=Path(__file__).resolve().parent / "conf"))
