//! Joins the program for browsers and the JavaScript through which a page calls it: `binder PROGRAM.wasm FOLDER`.

use std::env::args_os;
use std::error::Error;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<(), Box<dyn Error>> {
    let (Some(program), Some(folder)) = (args_os().nth(1), args_os().nth(2)) else {
        return Err("usage: binder PROGRAM.wasm FOLDER".into());
    };
    let mut binder = Bindgen::new();
    binder.input_path(program).out_name("sombrero").typescript(false);
    // Names are for debuggers, and a third of the size.
    binder.no_modules(true)?.remove_name_section(true).remove_producers_section(true);
    Ok(binder.generate(folder)?)
}
