//! Reports how to install `MuJoCo`'s library if it is missing; the error of the wrapper names no
//! remedy.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    println!("cargo::rerun-if-env-changed=MUJOCO_STATIC_LINK_DIR");
    println!("cargo::rerun-if-env-changed=DOCS_RS");
    // Documentation links nothing; a static library is the user's choice.
    if ["DOCS_RS", "MUJOCO_STATIC_LINK_DIR"].map(env::var_os) != [None, None] {
        return;
    }
    let Some(folder) = env::var_os("MUJOCO_DYNAMIC_LINK_DIR") else {
        return;
    };
    let folder = Path::new(&folder);
    println!("cargo::rerun-if-changed={}", folder.display());
    let names = ["libmujoco.so", "libmujoco.dylib", "mujoco.lib"];
    if !names.iter().any(|name| folder.join(name).is_file()) {
        println!(
            "cargo::error=MuJoCo's library is not in {}: install it with `ci/setup mujoco`",
            folder.display()
        );
    }
}
