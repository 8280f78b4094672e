#!/usr/bin/env bash
# Install this checkout into an environment: tools/install.sh ENVIRONMENT EXTRA
# uv unpacks 170 packages in 10 s where pip takes 2 min, most of it for bytecode that is never run. uv does not read pip's
# configuration; where uv is not to be had, or does not reach an index that pip knows, pip does the work.
set -euo pipefail

python=$1/bin/python
extra=$2

"$python" -m pip install --quiet --disable-pip-version-check uv ||
    echo "uv cannot be installed; pip will do, and takes longer" >&2
if [ -x "$1/bin/uv" ] && "$1/bin/uv" pip install --quiet --python "$python" --editable ".[$extra]"; then
    exit 0
fi
"$python" -m pip install --quiet --disable-pip-version-check --editable ".[$extra]"
