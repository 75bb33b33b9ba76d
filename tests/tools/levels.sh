#!/usr/bin/env bash
# Opens every level of some small scenes with readers that nobody here wrote: Khronos' validator, three.js and
# glTF-Transform. Some of the test scenes are among them where these stand beside the repository.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/tools/served.sh
. tests/tools/scenes.sh

scenes=$(test_scenes)
build_program
data="$work/data"
cat >"$work/rooms.plan" <<'PLAN'
#############
#a..#..b#...#
#...+...#.c.#
#...#...#...#
#############
PLAN
"$belvedere" bake "$work/rooms.plan" --scene rooms --data "$data"
for file in village-tiles/{house1-1,tree-beech-1-0}.glb edge-cases/primitive-modes/Mesh_PrimitiveMode_0{0,1,4}.gltf; do
  name=$(basename "$file")
  name=$(tr '[:upper:]_' '[:lower:]-' <<<"${name%.*}")
  if [ -n "$scenes" ]; then "$belvedere" bake "$scenes/$file" --scene "$name" --data "$data" --visibility occluders; fi
done
serve
BELVEDERE_URL="$base" node viewer/e2e/levels.mjs
