//! How the shared library is linked.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // The name by which the loader looks for it. A change that breaks programs changes the number.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libbench_dragon_c.so.0");
    // iceoryx2 exports its logger under one name for all versions: where a program has another iceoryx2, ours stays ours.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-Bsymbolic-functions");
}
