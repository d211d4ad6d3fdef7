# The sections of ci/test and ci/full, and the loop that runs them. ci/sections.toml lists their names,
# in their order, with the packages and paths that each depends on. A section is the function of its
# name; ci/full calls `full_NAME` where there is one. It fails as soon as one of its checks fails.

# Tests that can skip themselves must not.
export CI="${CI:-1}"

# Each change is judged by the same cases. PROPTEST_RNG_SEED=N selects others, PROPTEST_CASES=N
# more.
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-26}"

# Each crate is built once: intermediate results only cost, and so do the lines of back-traces in
# debug builds. Panics have theirs without them.
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0

# Everything is built once, with the plants on engines and `twin live`, which are cargo features.
features=twinrig/live,twinrig/mujoco,twinrig/rapier,twinrig-tests/mujoco,twinrig-tests/rapier
everything=(--workspace --locked --profile ci --features "$features")
# Examples of the documentation are built where the path of MuJoCo's library does not lead.
export LD_LIBRARY_PATH="$PWD/vendor/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
# The program, which the tests of the command line need. `cargo build` would make another one.
twin=target/ci/twin
# Where the Python package is tried: there is no cargo on the path of a user.
user_path=$PWD/target/venv-python/bin:/usr/bin:/bin

# --- Tools ---

# What the lints need; all else is installed meanwhile.
setup() {
    ci/setup tools
    ci/setup mujoco
    begin ci/setup
}

environments() {
    end ci/setup
    # Another call finds everything and needs no network.
    PIP_INDEX_URL=http://127.0.0.1:9 timeout 10 ci/setup
}

# --- Text ---

format() {
    cargo fmt --all -- --check
}

# With all features; then the default ones of the program, and nothing else anew.
lints() {
    cargo clippy "${everything[@]}" --all-targets --quiet -- -D warnings
    cargo clippy --locked --profile ci --quiet -p twinrig -p twinrig-fmu --features twinrig-fmu/ci \
        -- -D warnings
}

full_lints() {
    lints
    cargo clippy --workspace --all-targets --locked --quiet -- -D warnings
}

rustdoc() {
    RUSTDOCFLAGS="-D warnings" cargo doc "${everything[@]}" --no-deps --quiet
}

documentation() {
    end rustdoc
}

# The scripts of this folder.
scripts() {
    python3 ci/check_touched.py
    ci/budgets self
}

# --- Tests ---

# counted COMMAND…: runs test programs, and adds their results to the count.
counted() {
    "$@" 2>&1 | tee -a "$counts"
}

# Fails where a test fails, where none ran, and where a test program did not compile.
count_tests() {
    awk '/^test result:/ { passed += $4; failed += $6; ignored += $8; programs += 1 }
         END { printf "\n%d tests passed, %d failed, %d ignored, in %d test programs\n",
                      passed, failed, ignored, programs
               exit failed > 0 || passed == 0 }' "$counts"
}

# Packages with one or two examples in their documentation, none of which must not compile: they are
# left to ci/full.
few_examples=(twinrig-{actuator,bench,campaign,compliant,contact,description,experiment,feetech,lcp}
    twinrig-{legged,live,massless,motordriver,mujoco,rapier,robot,sbcp,script,servo,tactile,testing})

# Unit tests of all packages, and the test programs of those that a change touches.
tests() {
    local untouched
    mapfile -t untouched < <(ci/touched --untouched-packages)
    # It waits until the lock of the target folder is free: while tests run.
    begin rustdoc
    if [ "${#untouched[@]}" -eq 0 ]; then
        counted cargo test "${everything[@]}" --tests --no-fail-fast
    else
        counted cargo test "${everything[@]}" "${untouched[@]/#/--exclude=}" --tests --no-fail-fast
        counted cargo test "${everything[@]}" --lib --no-fail-fast
    fi
    counted cargo test "${everything[@]}" "${few_examples[@]/#/--exclude=}" --doc --no-fail-fast
    count_tests
}

# With the tests that are ignored as slow, all cases whose violations are listed in
# tests/rig/battery/known.txt, and all examples of the documentation.
full_tests() {
    local -x BATTERY_CASES=1000 BATTERY_HARSH=60 BATTERY_NOMINAL=100
    counted cargo test "${everything[@]}" --no-fail-fast
    counted cargo test "${everything[@]}" --tests --no-fail-fast -- --ignored --skip fused:: \
        --skip identification:: --skip killed
    count_tests
}

# Expectations must be able to fail.
mutations() {
    counted cargo test "${everything[@]}" --quiet --test mutations -- --include-ignored --nocapture
    count_tests
}

# The full plant against Pinocchio, that check against point masses, and trajectories against
# independent scripts. Compliant constraints are compared with point masses in SciPy by
# plants/lcp/tests/plant/compliant_peer.rs, fits with logs of a script by
# twin/experiment/tests/study/identification.rs, estimators with filterpy and SciPy by
# controllers/estimate/tests, and margins of expectations with rtamt by
# twin/scenario/tests/scenario/robustness, in section `tests`.
peers() {
    local scripts=plants/lcp/tests/reference python=target/venv-peers/bin/python
    local trajectory check checks=()
    for trajectory in passive free_base drop; do
        "$python" "$scripts/$trajectory.py" --check &
        checks+=($!)
    done
    "$python" "$scripts/pinocchio_check.py" --self
    cargo build "${everything[@]}" --quiet --example probe
    target/ci/examples/probe 1000 | "$python" "$scripts/pinocchio_check.py"
    for check in "${checks[@]}"; do
        wait "$check"
    done
}

# --- Runs ---

# The main scenario.
trot() {
    "$twin" run scenarios/trot.toml --no-record
}

# All shipped scenarios: fingerprints, and claims over some seeds; then on other plants.
scenarios() {
    begin make_wheel
    ci/fingerprints check --seeds 5
    scenarios_on_engines
}

scenarios_on_engines() {
    local plant
    for plant in mujoco rapier; do
        "$twin" run scenarios/passive-legs.toml --plant "$plant" --no-record
    done
    "$twin" run scenarios/trot.toml --plant rapier --no-record
    # At 2 ms it slips and rolls 1.5 and 1.8 times as far as at its converged step.
    "$twin" run scenarios/trot.toml --plant mujoco --set 'plant.step="0.5 ms"' --no-record
    "$twin" run scenarios/models/pup.toml --no-record
}

# All seeds, and what changes with them; then error bars, searches and the thesis' verdicts, of the
# program that users build.
full_scenarios() {
    cargo build --release --locked --quiet -p twinrig -p twinrig-fmu
    local file fast=()
    ci/fingerprints check --seeds 20 target/release/twin
    for file in scenarios/*.toml scenarios/thesis/*.toml; do
        # Those of more than a second have their error bars by hand.
        case "$file" in
            */trot-damped.toml | */fig-3-7.toml | */table-5-4.toml) ;;
            *) fast+=("$file") ;;
        esac
    done
    # Numerical errors leave no verdict open but those that are listed.
    ci/undecided "${fast[@]}"
    scenarios_on_engines
    local run=target/release/twin
    "$run" sweep scenarios/step-down.toml scenarios/sweeps/step-down.toml
    "$run" sweep scenarios/tegotae.toml scenarios/sweeps/tegotae.toml
    "$run" sweep scenarios/obstacle.toml scenarios/sweeps/obstacle.toml
    "$run" sweep scenarios/obstacle.toml scenarios/sweeps/obstacle-blind.toml
    "$run" optimize scenarios/trot.toml --space scenarios/optimizations/table-3-3.toml --iterations 2
    # Verdicts flip under the recorded moves.
    "$run" thesis --flips=least
}

# One fingerprint, whatever is around the run.
determinism() {
    ci/determinism "$twin"
}

# In all builds.
full_determinism() {
    ci/determinism "$twin"
    ci/determinism "$twin" scenarios/trot.toml --plant lcp
    ci/determinism "$twin" scenarios/thesis/fig-5-9.toml
    ci/determinism "$twin" scenarios/bench.toml
    ci/determinism builds
}

# Pages of runs in a browser: what is drawn, moved and compared.
pages() {
    nodejs twin/view/tests/figure.mjs
    target/venv/bin/python twin/view/tests/check.py "$twin"
}

# Scenarios in a browser, where the tool chain has the target.
playground() {
    if ! has_target wasm32-unknown-unknown; then
        echo "not tried: scenarios in a browser, without the target wasm32-unknown-unknown"
        return
    fi
    local page=target/playground
    ci/playground
    nodejs twin/playground/tests/scenarios.mjs "$page/playground.wasm" "$twin"
    target/venv/bin/python twin/playground/tests/page_check.py "$page/index.html" "$twin"
}

# The program on another system.
other_systems() {
    if has_target x86_64-pc-windows-gnu; then
        cargo check --locked --quiet -p twinrig --target x86_64-pc-windows-gnu
    fi
}

# has_target TARGET: whether the tool chain can build for it; ci/setup adds both.
has_target() {
    [ -d "$(rustc --print target-libdir --target "$1")" ]
}

# --- Packages ---

# Of the crates that the tests have built.
make_wheel() {
    WHEEL_PROFILE=ci ci/wheel
}

# The Python package, as a wheel that is installed where there is no cargo: types and stubs, and runs
# that equal those of the program.
python_package() {
    end make_wheel
    target/venv-python/bin/pip install --quiet --disable-pip-version-check --no-index --no-deps \
        --force-reinstall target/wheels/twinrig-*.whl
    (
        export PATH=$user_path TWIN=$PWD/$twin
        if command -v cargo; then
            echo "cargo is on the PATH of a user without it" >&2
            exit 1
        fi
        mypy
        stubtest twinrig --mypy-config-file pyproject.toml \
            --allowlist twin/python/tests/stubtest.txt
        python -m pytest --quiet -m "not ray and not slow"
    )
}

# The page of `twin live` in a browser, of the program that the section before has installed.
live_page() {
    target/venv/bin/python twin/view/tests/check_live.py target/venv-python/bin/python -m twinrig
}

# Exported FMUs, by the program and the library of the wheel, under two masters.
fmu() {
    PATH=$user_path python -m pytest --quiet twin/fmu/tests
}

# Sweeps on Ray clusters of this machine, with killed machines.
clusters() {
    PATH=/usr/bin:/bin target/venv-python/bin/python -m pytest --quiet -m ray
}

# What users of a package get builds.
packages() {
    ci/packages target/unpacked
    # With the profile above, crates of others are those of the lints.
    cargo check --offline --quiet --features testing \
        --config target/unpacked/config.toml --target-dir target \
        --manifest-path target/unpacked/twinrig-0.1.0/Cargo.toml
}

fuzz_targets() {
    cargo check --locked --quiet --manifest-path fuzz/Cargo.toml --target-dir target
}

# What `twin new` makes.
templates() {
    ci/templates check
}

full_templates() {
    ci/templates
}

# The action for users of GitHub, step by step, and the workflows of this repository.
action() {
    target/venv/bin/python ci/action/check.py "$twin"
    if [ -d target/node ]; then
        NODE_PATH=target/node/node_modules nodejs ci/action/workflows.cjs .github/workflows/*.yml
    else
        echo "not tried: the workflows of this repository, without npm"
    fi
}

# --- Figures ---

# Instructions, of the program that users build: assertions would count.
budgets() {
    cargo build --release --locked --quiet -p twinrig -p twinrig-fmu
    ci/budgets check
}

# The size of the tree.
lines() {
    ci/budgets lines
}

# --- The loop ---

work=$(mktemp -d)
counts=$work/counts
declare -A running
finished=()
section=

# begin COMMAND: runs it beside the sections that follow, which come first. It is a process group of
# its own, which a failure of another section ends with all its children.
begin() {
    set -m
    (
        set +m
        renice -n 10 -p "$BASHPID" >/dev/null || true
        "$1"
    ) >"$work/${1//\//_}" 2>&1 </dev/null &
    running[$1]=$!
    set +m
}

# end COMMAND: waits for it, if it was begun, and shows its output; else it runs it.
end() {
    local status=0
    if [ -z "${running[$1]-}" ]; then
        "$1"
        return
    fi
    wait "${running[$1]}" || status=$?
    unset "running[$1]"
    cat "$work/${1//\//_}"
    return "$status"
}

# Sets `computed` to the seconds of processor time of ended commands. A subshell has none of them.
read_processor_time() {
    times >"$work/times"
    computed=$(awk -F '[ms ]' 'NR == 2 { print int(60 * $1 + $2 + 60 * $4 + $5) }' "$work/times")
}

# report STATUS: the seconds of each section, those of processor time, the tests that it counted, and
# the section that failed.
report() {
    local group
    for group in "${running[@]}"; do
        kill -- "-$group" 2>/dev/null || true
    done
    rm -rf "$work"
    printf '\n'
    [ "${#finished[@]}" -eq 0 ] || printf '%6d s %6d s %6s tests  %s\n' "${finished[@]}"
    if [ "$1" -eq 0 ]; then
        printf '%6d s %6d s  in all\n' "$SECONDS" "$computed"
    else
        printf 'failed in section %s, after %d s\n' "${section//_/ }" "$SECONDS"
    fi
}

# run_sections PREFIX AFTER NAME…: runs these sections in turn, PREFIX_NAME where there is such a
# function, and calls AFTER with the name of each that has passed, its tests and seconds.
run_sections() {
    local prefix=$1 after=$2 command start begun number=0 total=$(($# - 2))
    shift 2
    trap 'report $?' EXIT
    for section; do
        number=$((number + 1)) start=$SECONDS
        read_processor_time
        begun=$computed
        : >"$counts"
        printf '\n== %d/%d %s (after %d s)\n' "$number" "$total" "${section//_/ }" "$SECONDS"
        command=$section
        if declare -F "${prefix}_$section" >/dev/null; then command=${prefix}_$section; fi
        "$command"
        read_processor_time
        finished+=("$((SECONDS - start))" "$((computed - begun))" "$(passed_tests)" "${section//_/ }")
        "$after" "$section" "$(passed_tests)" "$((SECONDS - start))" "$((computed - begun))"
    done
}

# The tests that a section has counted, or a dash.
passed_tests() {
    awk '/^test result:/ { passed += $4 } /^[0-9]+ passed/ { passed += $1 }
         END { print passed ? passed : "–" }' "$counts"
}
