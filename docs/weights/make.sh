#!/usr/bin/env bash
# The recipe of the next weights, on a CPU or on a GPU where there is one: data, training, figures.
#   docs/weights/make.sh FOLDER [more overrides of train.py]
# FOLDER/meshes/{train,train_extra,more,val,test} hold the mesh files of docs/characters.md without those of quaternius-ultimate, whose skin
# is black by a fault of their export: these lie in FOLDER/meshes/ultimate and get skin colours here. Each step goes on where it was
# interrupted; a data set that is there is not made again. A GPU has room for `scale=base trainer=gpu`.
set -euo pipefail

folder="$1"
shift
data="$folder/characters"

capture() { # split, folders of meshes separated by spaces, further options
  [ -e "$data/.$1" ] && return
  local folders=()
  for name in $2; do folders+=("$folder/meshes/$name"); done
  charnerf capture "${folders[@]}" -o "$data" --split "$1" "${@:3}"
  touch "$data/.$1"
}
if [ ! -e "$folder/meshes/chibi" ]; then
  python - "$folder/meshes" <<'PYTHON'
import sys
from pathlib import Path

import numpy as np
import trimesh

meshes = Path(sys.argv[1])
tones = [(69, 22, 3), (146, 61, 13), (191, 107, 36), (225, 139, 53), (255, 182, 107), (29, 9, 1)]  # linear
made = meshes / "chibi.part"
made.mkdir(exist_ok=True)
for number, file in enumerate(sorted((meshes / "ultimate").glob("*.glb"))):
    scene = trimesh.load(file, process=False)
    for part in scene.geometry.values():
        if part.visual.material.name == "Skin":
            part.visual.material.baseColorFactor = np.array((*tones[number % len(tones)], 255), np.uint8)
    scene.export(made / file.name)
made.rename(meshes / "chibi")
PYTHON
fi
if [ ! -e "$data/.embedded" ]; then
  charnerf generate -o "$data" --train 240 --val 0 --test 0 --seed 0
  python - "$data/dataset.json" <<'PYTHON'
import json, sys
dataset = json.load(open(sys.argv[1]))
dataset["splits"] = {"embedded": dataset["splits"]["train"]}
json.dump(dataset, open(sys.argv[1], "w"), indent=1)
PYTHON
  touch "$data/.embedded"
fi
capture train train
capture train_extra train_extra
capture chibi chibi
capture more more
capture val val
capture test test
capture variants "train train_extra chibi more" --views 24 --variants 3 --seed 1
capture swaps "train train_extra chibi more" --views 24 --swaps 6 --seed 1

trained() { # folder of the run, further overrides
  local resume=()
  [ -e "$1/checkpoints/last.ckpt" ] && resume=("ckpt_path=$1/checkpoints/last.ckpt")
  python train.py data=folder "data.root=$data" features=image_hull_section_consistency encoder.coarse_width=64 \
    encoder.coarse_channels=64 batches.foreground_share=0.65 batches.memory_mib=16000 "hydra.run.dir=$1" "${resume[@]}" "${@:2}"
}
trained "$folder/run" 'splits.train=[train,train_extra,chibi,train,train_extra,chibi,more,more,more,variants,swaps,embedded]' \
  'augmentation=[stretch,recolor,mirror]' augmentation.recolor.share=0.7 augmentation.stretch.share=0.8 averaging.decay=0.998 \
  budget.seconds=3960 "$@"
# a last stretch by what a network sees in the pictures: sharper ones
trained "$folder/sharp" 'splits.train=[train,train_extra,chibi]' "start_from=$folder/run" loss.perceptual.weight=0.1 \
  +schedule.phases.0.square=64 scale.learning_rate=5e-4 optimizer.matrix_lr=0.002 budget.seconds=null budget.steps=300 "$@"

charnerf evaluate "$folder/sharp" --data "$data" --split test -o "$folder/measured" \
  --nearest-from "$data:train" --nearest-from "$data:train_extra" --nearest-from "$data:embedded"
