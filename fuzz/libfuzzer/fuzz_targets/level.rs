#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| belvedere_fuzz::check("level", bytes));
