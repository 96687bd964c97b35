//! What the tests have in common: rendering a scene that stands in a string, and the mean of an image with
//! its standard error.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use etendue::description::{self, Description};
use etendue::image::Image;
use etendue::render::{Options, Overrides, Rendered, Silent, render};

/// A file or folder of the checkout.
pub(crate) fn at(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The Python that has Mitsuba, or a line past the capture of the test's output that there is none.
pub(crate) fn mitsuba() -> Option<PathBuf> {
    // That of ETENDUE_PYTHON, or the one that tools/venv makes in the target directory.
    let environment = Path::new(env!("CARGO_BIN_EXE_etendue")).ancestors().nth(2);
    let environment = environment.map(|target| target.join("venv/bin/python"));
    let named = std::env::var_os(etendue::crosscheck::VARIABLE).map(PathBuf::from);
    let python = named.or(environment);
    let works = |python: &PathBuf| {
        let run = Command::new(python).args(["-c", "import mitsuba"]).output();
        run.is_ok_and(|output| output.status.success())
    };
    let found = python.filter(works);
    if found.is_none() {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no Python has Mitsuba; tools/venv makes one"
        );
    }
    found
}

/// Reads a scene from `text`, whose relative paths start at the checkout.
pub(crate) fn describe(text: &str) -> Description {
    Description::parse(text, &at("test.xml"), &description::Options::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Renders `text` with the given seed.
pub(crate) fn image_of(text: &str, seed: u64) -> Image {
    let options = Options {
        seed,
        ..Options::default()
    };
    rendered(text, &Overrides::default(), &options).image
}

/// Renders `text` as the options say.
pub(crate) fn rendered(text: &str, overrides: &Overrides, options: &Options) -> Rendered {
    let mut description = describe(text);
    overrides.apply(&mut description);
    render(&description, options, &Silent).unwrap_or_else(|e| panic!("{e}"))
}

/// A sensor that sees next to nothing but the point `target`, from `origin`; its pixels are independent.
pub(crate) fn meter(origin: [f64; 3], target: [f64; 3], size: u32, spp: u32) -> String {
    let point = |p: [f64; 3]| format!("{}, {}, {}", p[0], p[1], p[2]);
    format!(
        r#"<sensor type="perspective">
            <float name="fov" value="0.02"/>
            <transform name="to_world">
                <lookat origin="{}" target="{}" up="0.1, 0.2, 1"/>
            </transform>
            {}
        </sensor>"#,
        point(origin),
        point(target),
        film(size, size, spp)
    )
}

/// A film of independent pixels.
pub(crate) fn film(width: u32, height: u32, spp: u32) -> String {
    format!(
        r#"<film type="hdrfilm">
            <integer name="width" value="{width}"/>
            <integer name="height" value="{height}"/>
            <rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>"#
    )
}

/// A scene around `body`.
pub(crate) fn scene(body: &str) -> String {
    format!(r#"<scene version="3.0.0">{body}</scene>"#)
}

/// The integrator `path` of this depth, without roulette.
pub(crate) fn path(max_depth: i64) -> String {
    format!(
        r#"<integrator type="path">
            <integer name="max_depth" value="{max_depth}"/>
            <integer name="rr_depth" value="100"/>
        </integrator>"#
    )
}

/// A mean and the standard error of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mean {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Mean {
    /// Of independent values.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().collect();
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0);
        Self {
            value,
            error: (variance / n).sqrt(),
        }
    }

    /// Of one channel of an image whose pixels are independent.
    pub(crate) fn of_channel(image: &Image, channel: usize) -> Self {
        let stride = image.channels().len();
        Self::of(image.data().chunks(stride).map(|p| f64::from(p[channel])))
    }

    /// Fails unless the mean is `expected` to within its error, and the error is below `precision` of it.
    #[track_caller]
    pub(crate) fn assert_is(&self, expected: f64, precision: f64, what: &str) {
        let Self { value, error } = self;
        assert!(
            *error <= precision * expected.abs(),
            "{what}: {value} ± {error} is too noisy to be held against {expected}"
        );
        assert!(
            (value - expected).abs() <= 4.5 * error + 2e-5 * expected.abs(),
            "{what}: {value} ± {error} is not {expected}"
        );
    }

    /// Fails unless the two means are equal to within their errors, which are below `precision`.
    #[track_caller]
    pub(crate) fn assert_equals(&self, other: &Self, precision: f64, what: &str) {
        Self {
            value: self.value,
            error: self.error.hypot(other.error),
        }
        .assert_is(other.value, precision, what);
    }
}

/// Lets programs that are started from here on hear Ctrl-C and SIGHUP, also where these tests do not: a shell has what it
/// starts in the background ignore the one, `nohup` the other, and whoever ignores a signal hands that down. A handler is
/// not handed down.
#[cfg(unix)]
pub(crate) fn let_children_hear_interrupts() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::{consts, flag};

    for signal in [consts::SIGINT, consts::SIGHUP] {
        let ends = Arc::new(AtomicBool::new(true));
        flag::register_conditional_shutdown(signal, 130, ends).expect("the system takes a handler");
    }
}
