# The sections of ci/test and ci/full as functions, and the loop that runs them; both source this file.
# A name of ci/sections.toml is that of a function, which fails if one of its checks fails.

# Tests that can skip themselves must not.
export CI="${CI:-1}"

# Each change is judged by the same cases. PROPTEST_RNG_SEED=N selects others, PROPTEST_CASES=N
# more.
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-26}"

# Each crate is built once: intermediate results only cost, and so do the lines of back-traces in
# debug builds. Panics have theirs without them.
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0

# One build of everything: with the plants on engines and `twin live`, which are cargo features. The
# program is target/ci/twin.
everything=(--workspace --locked --profile ci
    --features twinrig/live,twinrig/mujoco,twinrig/rapier,twinrig-tests/mujoco,twinrig-tests/rapier)
twin=target/ci/twin
