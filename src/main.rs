//! The `etendue` command.

mod cli;

fn main() -> std::process::ExitCode {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !etendue::image::is_decoding() {
            tell(panic);
        }
    }));
    cli::run()
}
