#!/usr/bin/env bash
# Create a virtual environment: tools/make_environment.sh DIRECTORY [PYTHON]
# Without PYTHON the first interpreter on PATH that is new enough is taken. Needs nothing but Python >= 3.11; where
# Debian has split off `ensurepip` it is installed with apt-get if we may, else the command to do so is printed.
set -euo pipefail

directory=$1
wanted=${2:-}

new_enough() { command -v "$1" >/dev/null 2>&1 && "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

python=
for candidate in ${wanted:-python3 python3.14 python3.13 python3.12 python3.11}; do
    if new_enough "$candidate"; then python=$candidate; break; fi
done
if [ -z "$python" ]; then
    echo "activesteer needs Python 3.11 or newer; tried: ${wanted:-python3 and python3.11 to python3.14}." >&2
    echo "Name another one with: make PYTHON=/path/to/python3.11 ..." >&2
    exit 1
fi

if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        echo "$python has no ensurepip: installing $package with apt-get"
        apt-get update -qq
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$package" >/dev/null
    else
        echo "$python cannot make virtual environments: its module ensurepip is missing." >&2
        echo "On Debian and Ubuntu: sudo apt-get install $package" >&2
        exit 1
    fi
fi

"$python" -m venv "$directory"
