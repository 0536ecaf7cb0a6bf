#!/usr/bin/env bash
# Makes the lock files from the *.in files. Needs `uv` (pip install uv); run after changing a *.in.
#
# One lock serves Python 3.10 to 3.13 through environment markers. No hashes: where a CPU build of
# torch lies on disk, pip takes that one. torch's CUDA parts stay out of the lock for the same
# reason: the builds that need them name them themselves.
set -euo pipefail
cd "$(dirname "$0")"
export UV_CUSTOM_COMPILE_COMMAND='requirements/compile.sh'
compile=(uv pip compile --quiet --universal --python-version 3.10 --no-annotate "$@")

cuda=(triton cuda-bindings cuda-pathfinder cuda-toolkit nvidia-cublas nvidia-cuda-cupti
      nvidia-cuda-nvrtc nvidia-cuda-runtime nvidia-cudnn-cu13 nvidia-cufft nvidia-cufile
      nvidia-curand nvidia-cusolver nvidia-cusparse nvidia-cusparselt-cu13 nvidia-nccl-cu13
      nvidia-nvjitlink nvidia-nvshmem-cu13 nvidia-nvtx)

# base first: all the others have to agree with what it chose, and with those before them.
"${compile[@]}" "${cuda[@]/#/--no-emit-package=}" base.in --output-file base.lock
constraints=(--constraint base.lock)
for part in ros sim dashboard experiments dev docs; do
    "${compile[@]}" "$part.in" "${constraints[@]}" --output-file "$part.lock"
    constraints+=(--constraint "$part.lock")
done

if grep --extended-regexp --line-number 'nvidia|cuda|triton|://' ./*.lock; then
    echo 'compile.sh: the lines above must not be in a lock; add the packages to `cuda`.' >&2
    exit 1
fi
