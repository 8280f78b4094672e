#!/usr/bin/env bash
# Run the tests as on other processors, one setting after the other, and print a table.
#   tools/test_processors.sh [PYTEST ARGUMENTS]     default: -m "not slow"; -m "" adds the slow tests
# Each setting has an empty cache of steering amplitudes. Log files are in build/processors.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=$PWD/.venv/bin/python
logs=build/processors
mkdir -p "$logs"
if [ $# = 0 ]; then set -- -m "not slow"; fi

# name | environment | arguments of pytest
settings=(
    "as the machine is||"
    "generic compiler target|NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES=|"
    "numpy without AVX-512|NPY_DISABLE_CPU_FEATURES=X86_V4 AVX512_ICL AVX512_SPR|"
    "numpy with SSE only|NPY_DISABLE_CPU_FEATURES=X86_V3 X86_V4 AVX512_ICL AVX512_SPR|"
    "BLAS of Nehalem|OPENBLAS_CORETYPE=Nehalem|"
    "BLAS of Zen|OPENBLAS_CORETYPE=Zen|"
    "one process||-n 0"
    "four processes||-n 4"
    "hash seed 1|PYTHONHASHSEED=1|"
)
# numpy refuses to disable a feature that this processor or this numpy does not have.
known=$("$python" -c '
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
print(*[name for name in __cpu_dispatch__ if __cpu_features__.get(name)])')

printf '%-26s %8s %8s %8s %10s\n' setting passed failed skipped time
status=0
for setting in "${settings[@]}"; do
    IFS='|' read -r name environment arguments <<<"$setting"
    log="$logs/${name// /_}.log"
    cache=$(mktemp -d)
    variables=(XDG_CACHE_HOME="$cache")
    if [[ $environment == NPY* ]]; then
        wanted=
        for feature in ${environment#*=}; do [[ " $known " == *" $feature "* ]] && wanted+=" $feature"; done
        if [ -z "$wanted" ]; then
            printf '%-26s not possible here: numpy uses only %s\n' "$name" "$known"
            continue
        fi
        variables+=("NPY_DISABLE_CPU_FEATURES=${wanted# }")
    else
        for variable in $environment; do variables+=("$variable"); done
    fi
    start=$SECONDS
    # shellcheck disable=SC2086 # arguments are several words
    env "${variables[@]}" "$python" -m pytest -q -n logical --maxprocesses 4 --dist loadgroup --no-loadscope-reorder \
        $arguments "$@" >"$log" 2>&1 || status=1
    count() { grep -oE "[0-9]+ $1" "$log" | tail -n 1 | grep -oE '[0-9]+' || echo 0; }
    printf '%-26s %8s %8s %8s %8s s\n' \
        "$name" "$(count passed)" "$(count failed)" "$(count skipped)" "$((SECONDS - start))"
    grep -E '^(FAILED|ERROR) ' "$log" | sed 's/^/    /'
    rm -rf "$cache"
done
exit $status
