#!/bin/sh
# Install realbench and scene official into a folder of its own: container/install.sh FOLDER
# Used by the Dockerfile, and by CI where there is no docker.
set -eu
target=$1
here=$(cd "$(dirname "$0")/.." && pwd)
python3 -m venv "$target"
# the CPU build of torch: the other one is ten times as large, and controllers get no GPU; an empty
# TORCH_INDEX has pip look where it always does
index=${TORCH_INDEX-https://download.pytorch.org/whl/cpu}
"$target/bin/pip" install --quiet --no-cache-dir --disable-pip-version-check \
    ${index:+--extra-index-url "$index"} \
    --constraint "$here/constraints.txt" "$here"
XDG_DATA_HOME="$target/share" "$target/bin/realbench" scene install
