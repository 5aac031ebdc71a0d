//! Link options of the shared library.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Name under which the loader searches for the library. A change that breaks programs increments the number.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libbench_dragon_c.so.0");
    // iceoryx2 exports its logger under one name for all versions. With this option our library keeps its own logger in a
    // program with another iceoryx2.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-Bsymbolic-functions");
}
