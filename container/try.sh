#!/bin/sh
# Try what was installed, as somebody who may write only where he is: container/try.sh FOLDER
set -eu
target=$1
export PATH="$target/bin:$PATH" XDG_DATA_HOME="$target/share"
HOME=$(mktemp -d) && export HOME
cd "$HOME"
[ "$(id -u)" -ne 0 ] || echo "tried as root: the container's user is another one"
realbench doctor
realbench scene list
realbench submission init mine
realbench submission check mine
realbench goals generate --scene builtin --2d 1 --25d 0 --3d 0 --secret --out secret.npy
cat > round.yaml <<'YAML'
title: Try
scene: builtin
rounds: {try: {condition: OM, goals: secret.npy, steps: 2000, trial_steps: 1000}}
YAML
mkdir submissions && mv mine submissions/mine
realbench round run submissions round.yaml
realbench leaderboard results --format json | grep -q '"status": "scored"'
echo "the installation in $target works"
