//! Open Image Denoise 2 through its C interface, from a library that is loaded at run time: the program is neither built
//! with it nor needs it. All foreign calls of the program are here.
#![expect(
    unsafe_code,
    reason = "a foreign library has a foreign interface; each call says why it is sound"
)]

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr;

use libloading::Library;

use crate::error::{Error, Result};

/// What the library is called on this system.
#[cfg(target_os = "windows")]
const NAMES: &[&str] = &["OpenImageDenoise.dll"];
#[cfg(target_os = "macos")]
const NAMES: &[&str] = &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const NAMES: &[&str] = &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"];

/// What to do where there is none.
const HELP: &str = "install Open Image Denoise 2: `pip install pyoidn` brings it as site-packages/pyoidn/oidn/lib, distributions \
    call it oidn or libopenimagedenoise; and name the library or its folder by --denoise-lib or ETENDUE_DENOISE_LIB";

/// `OIDN_DEVICE_TYPE_CPU`.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// A device or a filter.
type Object = *mut c_void;

/// The library's functions, as oidn.h of version 2 declares them.
#[derive(Debug)]
struct Functions {
    new_device: unsafe extern "C" fn(c_int) -> Object,
    commit_device: unsafe extern "C" fn(Object),
    set_device_int: unsafe extern "C" fn(Object, *const c_char, c_int),
    get_device_int: unsafe extern "C" fn(Object, *const c_char) -> c_int,
    get_device_error: unsafe extern "C" fn(Object, *mut *const c_char) -> c_int,
    release_device: unsafe extern "C" fn(Object),
    new_filter: unsafe extern "C" fn(Object, *const c_char) -> Object,
    set_shared_filter_image: unsafe extern "C" fn(
        Object,
        *const c_char,
        *mut c_void,
        c_int,
        usize,
        usize,
        usize,
        usize,
        usize,
    ),
    set_filter_bool: unsafe extern "C" fn(Object, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(Object),
    execute_filter: unsafe extern "C" fn(Object),
    release_filter: unsafe extern "C" fn(Object),
}

/// The library with a device of the processor.
#[derive(Debug)]
pub(super) struct Oidn {
    functions: Functions,
    device: Object,
    /// Holds the code of the functions, and goes last.
    _library: Library,
}

/// Pixels of three numbers, row by row.
#[derive(Debug)]
pub(super) struct Colors<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: &'a [[f32; 3]],
}

/// What a filter is told besides the image.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Setting<'a> {
    /// Diffuse reflectance of what is seen.
    pub(super) albedo: Option<&'a [[f32; 3]]>,
    /// Its shading normal.
    pub(super) normal: Option<&'a [[f32; 3]]>,
}

/// What is denoised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    /// Light, of any size.
    Color,
    /// The guide itself.
    Albedo,
    /// The guide itself.
    Normal,
}

impl Oidn {
    /// From the file or the folder that is named, or from where the system looks for libraries.
    pub(super) fn load(path: Option<&Path>) -> Result<Self> {
        let candidates: Vec<PathBuf> = match path {
            None => NAMES.iter().map(PathBuf::from).collect(),
            Some(folder) if folder.is_dir() => NAMES.iter().map(|name| folder.join(name)).collect(),
            Some(file) => vec![file.to_owned()],
        };
        let mut why = String::new();
        for candidate in &candidates {
            // SAFETY: to load a library runs its initialisation. It is the user who names the file or has installed it
            // where the system looks, as with every shared library.
            match unsafe { Library::new(candidate) } {
                Ok(library) => return Self::of(library, candidate),
                Err(error) => why = error.to_string(),
            }
        }
        Err(Error::input(format!("the denoiser's library cannot be loaded: {why}")).help(HELP))
    }

    fn of(library: Library, path: &Path) -> Result<Self> {
        let lacks = |error: libloading::Error| {
            let message = format!("{} is no Open Image Denoise 2: {error}", path.display());
            Error::input(message).help(HELP)
        };
        macro_rules! function {
            ($name:literal) => {
                // SAFETY: the symbol is that of oidn.h, whose declaration the field's type repeats; the pointer is kept
                // beside the library, which is not closed before it.
                *unsafe { library.get(concat!($name, "\0").as_bytes()) }.map_err(lacks)?
            };
        }
        let functions = Functions {
            new_device: function!("oidnNewDevice"),
            commit_device: function!("oidnCommitDevice"),
            set_device_int: function!("oidnSetDeviceInt"),
            get_device_int: function!("oidnGetDeviceInt"),
            get_device_error: function!("oidnGetDeviceError"),
            release_device: function!("oidnReleaseDevice"),
            new_filter: function!("oidnNewFilter"),
            set_shared_filter_image: function!("oidnSetSharedFilterImage"),
            set_filter_bool: function!("oidnSetFilterBool"),
            commit_filter: function!("oidnCommitFilter"),
            execute_filter: function!("oidnExecuteFilter"),
            release_filter: function!("oidnReleaseFilter"),
        };
        // SAFETY: takes a number of the header's and no pointer.
        let device = unsafe { (functions.new_device)(CPU) };
        let oidn = Self {
            functions,
            device,
            _library: library,
        };
        if device.is_null() {
            return Err(oidn.error("has no device for this processor"));
        }
        Ok(oidn)
    }

    /// Makes the device ready.
    pub(super) fn start(&self, threads: usize) -> Result<()> {
        let threads = c_int::try_from(threads).unwrap_or(0);
        // SAFETY: the device is one of the library's, and the name ends in 0.
        unsafe {
            (self.functions.set_device_int)(self.device, c"numThreads".as_ptr(), threads);
            (self.functions.set_device_int)(self.device, c"setAffinity".as_ptr(), 0);
            (self.functions.commit_device)(self.device);
        }
        self.check("cannot be started")
    }

    /// The version, such as 20501 for 2.5.1.
    pub(super) fn version(&self) -> i32 {
        // SAFETY: the device is one of the library's, and the name ends in 0.
        unsafe { (self.functions.get_device_int)(self.device, c"version".as_ptr()) }
    }

    /// What `image` becomes.
    pub(super) fn filter(
        &self,
        subject: Subject,
        image: &Colors<'_>,
        setting: Setting<'_>,
    ) -> Result<Vec<[f32; 3]>> {
        let mut output = vec![[0.0f32; 3]; image.values.len()];
        assert_eq!(image.values.len(), image.width * image.height);
        let guides = [(c"albedo", setting.albedo), (c"normal", setting.normal)];
        let given = guides
            .into_iter()
            .filter_map(|(name, values)| Some((name, values?)));
        let main = match subject {
            Subject::Color => c"color",
            Subject::Albedo => c"albedo",
            Subject::Normal => c"normal",
        };
        let inputs: Vec<(&CStr, &[[f32; 3]])> =
            std::iter::once((main, image.values)).chain(given).collect();
        assert!(
            inputs
                .iter()
                .all(|(_, values)| values.len() == output.len())
        );
        // SAFETY: the device is one of the library's, and the name ends in 0.
        let filter = unsafe { (self.functions.new_filter)(self.device, c"RT".as_ptr()) };
        if filter.is_null() {
            return Err(self.error("has no filter"));
        }
        let set = |name: &CStr, data: *mut c_void| {
            // SAFETY: the filter lives; `data` points to width × height pixels of three floats without gaps, which
            // outlive it. The library does not write to its inputs.
            unsafe {
                (self.functions.set_shared_filter_image)(
                    filter,
                    name.as_ptr(),
                    data,
                    FLOAT3,
                    image.width,
                    image.height,
                    0,
                    0,
                    0,
                );
            }
        };
        for (name, values) in &inputs {
            set(name, values.as_ptr().cast_mut().cast());
        }
        set(c"output", output.as_mut_ptr().cast());
        // SAFETY: the filter and its images live until it is released below; names end in 0. `output` is written to
        // while it is executed, and nobody else has it.
        unsafe {
            if subject == Subject::Color {
                (self.functions.set_filter_bool)(filter, c"hdr".as_ptr(), true);
                let clean = inputs.len() > 1;
                (self.functions.set_filter_bool)(filter, c"cleanAux".as_ptr(), clean);
            }
            (self.functions.commit_filter)(filter);
            (self.functions.execute_filter)(filter);
            (self.functions.release_filter)(filter);
        }
        self.check("cannot denoise the image")?;
        Ok(output)
    }

    /// The library's error, if there is one.
    fn message(&self) -> Option<String> {
        let mut text: *const c_char = ptr::null();
        // SAFETY: the device is one of the library's or null, which asks for the thread's error; `text` is written to.
        let code = unsafe { (self.functions.get_device_error)(self.device, &raw mut text) };
        if code == 0 || text.is_null() {
            return (code != 0).then(|| format!("error {code}"));
        }
        // SAFETY: the library has set a string that ends in 0 and stays until its next call.
        Some(
            unsafe { CStr::from_ptr(text) }
                .to_string_lossy()
                .into_owned(),
        )
    }

    fn error(&self, what: &str) -> Error {
        let why = self
            .message()
            .unwrap_or_else(|| "it does not say why".to_owned());
        Error::input(format!("the denoiser {what}: {why}"))
    }

    fn check(&self, what: &str) -> Result<()> {
        match self.message() {
            None => Ok(()),
            Some(why) => Err(Error::input(format!("the denoiser {what}: {why}"))),
        }
    }
}

impl Drop for Oidn {
    fn drop(&mut self) {
        if !self.device.is_null() {
            // SAFETY: the device is one of the library's, and nobody has it any more.
            unsafe { (self.functions.release_device)(self.device) };
        }
    }
}
