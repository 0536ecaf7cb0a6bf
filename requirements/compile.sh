#!/usr/bin/env bash
# Makes the lock files from the *.in files. Needs `uv` (pip install uv); run after changing a *.in.
#
# One lock serves Python 3.10 to 3.13 through environment markers. Each file that pip may download
# has its hash in the lock, and pip refuses any other. torch alone has none, in a lock of its own:
# which build of it is right, for the CPU or for a GPU, is the machine's to say, and the builds for
# a GPU name the CUDA packages that they need.
set -euo pipefail
cd "$(dirname "$0")"
export UV_CUSTOM_COMPILE_COMMAND='requirements/compile.sh'
compile=(uv pip compile --quiet --universal --generate-hashes --no-strip-extras
         --python-version 3.10 --no-annotate "$@")

without=(torch triton cuda-bindings cuda-pathfinder cuda-toolkit nvidia-cublas nvidia-cuda-cupti
         nvidia-cuda-nvrtc nvidia-cuda-runtime nvidia-cudnn-cu13 nvidia-cufft nvidia-cufile
         nvidia-curand nvidia-cusolver nvidia-cusparse nvidia-cusparselt-cu13 nvidia-nccl-cu13
         nvidia-nvjitlink nvidia-nvshmem-cu13 nvidia-nvtx)

# base first: all the others have to agree with what it chose, and with those before them.
"${compile[@]}" "${without[@]/#/--no-emit-package=}" base.in --output-file base.lock
constraints=(--constraint base.lock)
for part in ros sim dashboard experiments dev docs; do
    "${compile[@]}" "$part.in" "${constraints[@]}" --output-file "$part.lock"
    constraints+=(--constraint "$part.lock")
done
"${compile[@]}" ros-kilted.in --constraint base.lock --output-file ros-kilted.lock
"${compile[@]}" "${without[@]/#/--no-emit-package=}" ppo.in "${constraints[@]}" \
    --constraint base.in --output-file ppo.lock
{
    echo '# This file was made by requirements/compile.sh, which says why it has no hash.'
    grep '^torch==' base.in
} > torch.lock

if grep --extended-regexp --line-number '^(nvidia|cuda|triton)|://' ./*.lock; then
    echo 'compile.sh: the lines above must not be in a lock; add the packages to `without`.' >&2
    exit 1
fi
