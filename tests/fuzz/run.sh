#!/usr/bin/env bash
# Runs one fuzz target for some time, starting from the kept corpus and the inputs that earlier runs found.
# Usage: tests/fuzz/run.sh TARGET SECONDS [LIBFUZZER OPTION...]      TARGET: tokenizer import ply image picture baked trace
# Prints libFuzzer's counts: executions, executions per second, coverage (edges and features) and corpus size.
# Exit code 1: there is a finding; its input is in build/fuzz/findings/TARGET. BUILD selects another build folder.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,5s/^# //p' "$0" >&2; exit 2; }
target=$1
seconds=$2
shift 2
cd "$(dirname "$0")/../.."
build=$(realpath -m "${BUILD:-build/fuzz}")

[ -f "$build/build.ninja" ] || cmake --preset fuzz -B "$build" >/dev/null
cmake --build "$build" --target "packtrace_${target}_fuzzer"
mapfile -t arguments < "$build/tests/fuzz/$target.arguments"
grown=$build/corpus/$target
findings=$build/findings/$target
mkdir -p "$grown" "$findings"
log=$findings/log

status=0
UBSAN_OPTIONS=print_stacktrace=1 "$build/bin/packtrace_${target}_fuzzer" \
  -max_total_time="$seconds" -timeout=5 -rss_limit_mb=1024 -max_len=16384 -print_final_stats=1 \
  -artifact_prefix="$findings/" "$@" "$grown" "${arguments[@]}" >"$log" 2>&1 || status=1
grep -aE '^(stat::|==|SUMMARY|finding:|artifact)|ERROR|runtime error|terminate called|what\(\)' "$log" || true
grep -aE '^#[0-9]+.* cov: ' "$log" | tail -n 1
echo "corpus: $(find "$grown" -type f | wc -l) inputs in $grown"
[ $status -eq 0 ] || echo "FINDING: see $log and $findings"
exit $status
