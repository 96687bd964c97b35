//! Embree 4 by its C interface, loaded at run time from the library that `EMBREE_LIB` names. The types have
//! the layout of `rtcore_ray.h` and `rtcore_scene.h` of Embree 4.4, of which only what is used stands here.

#![allow(unsafe_code, non_snake_case)] // the interface of a C library

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::ptr::null;
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::time::Instant;

use etendue::interaction::{Hit, Ray};
use etendue::shape::Geometry;
use libloading::Library;

use crate::meshes::triangles;
use crate::peer::{Built, Maker, Peer};
use crate::rays::{Batch, Question};
use crate::strands::Strands;

/// `RTCRay`.
#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
}

/// `RTCRayHit`.
#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: c_uint,
    geometry: c_uint,
    instance: c_uint,
    instance_primitive: c_uint,
}

/// `RTCRayHit16`.
#[repr(C, align(64))]
struct RtcRayHit16 {
    origin: [[f32; 16]; 3],
    t_near: [f32; 16],
    direction: [[f32; 16]; 3],
    time: [f32; 16],
    t_far: [f32; 16],
    mask: [c_uint; 16],
    id: [c_uint; 16],
    flags: [c_uint; 16],
    normal: [[f32; 16]; 3],
    u: [f32; 16],
    v: [f32; 16],
    primitive: [c_uint; 16],
    geometry: [c_uint; 16],
    instance: [c_uint; 16],
    instance_primitive: [c_uint; 16],
}

/// Which rays of sixteen there are; Embree wants it aligned as it wants the rays.
#[repr(align(64))]
struct Valid([c_int; 16]);

/// `RTCIntersectArguments`.
#[repr(C)]
struct RtcArguments {
    flags: c_uint,
    features: c_uint,
    context: *const c_void,
    filter: *const c_void,
    intersect: *const c_void,
    /// Only where the library was built with it; else not read.
    min_width_distance_factor: f32,
}

/// `RTC_INVALID_GEOMETRY_ID`.
const NONE: c_uint = c_uint::MAX;
/// `RTC_RAY_QUERY_FLAG_COHERENT`.
const COHERENT: c_uint = 1 << 16;
/// `RTC_SCENE_FLAG_ROBUST`.
const ROBUST: c_int = 1 << 2;
/// `RTC_BUILD_QUALITY_MEDIUM`.
const MEDIUM: c_int = 1;
/// `RTC_BUILD_QUALITY_HIGH`.
const HIGH: c_int = 2;

type Handle = *mut c_void;
type Monitor = extern "C" fn(*mut c_void, isize, bool) -> bool;

macro_rules! functions {
    ($($name:ident: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions that are called, by their own names.
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// Keeps them loaded.
            _library: Library,
        }

        impl Functions {
            /// # Safety
            /// `library` must be Embree 4, whose functions have these types.
            unsafe fn of(library: Library) -> Result<Self, libloading::Error> {
                // SAFETY: the caller promises the types; the pointers stay valid with `_library`.
                $(let $name = *unsafe { library.get(stringify!($name)) }?;)*
                Ok(Self { $($name,)* _library: library })
            }
        }
    };
}

functions! {
    rtcNewDevice: fn(*const c_char) -> Handle;
    rtcReleaseDevice: fn(Handle);
    rtcGetDeviceError: fn(Handle) -> c_int;
    rtcGetDeviceProperty: fn(Handle, c_int) -> isize;
    rtcSetDeviceMemoryMonitorFunction: fn(Handle, Monitor, *mut c_void);
    rtcNewGeometry: fn(Handle, c_int) -> Handle;
    rtcReleaseGeometry: fn(Handle);
    rtcSetGeometryBuildQuality: fn(Handle, c_int);
    rtcSetSharedGeometryBuffer: fn(Handle, c_int, c_uint, c_int, *const c_void, usize, usize, usize);
    rtcCommitGeometry: fn(Handle);
    rtcNewScene: fn(Handle) -> Handle;
    rtcReleaseScene: fn(Handle);
    rtcSetSceneBuildQuality: fn(Handle, c_int);
    rtcSetSceneFlags: fn(Handle, c_int);
    rtcAttachGeometry: fn(Handle, Handle) -> c_uint;
    rtcCommitScene: fn(Handle);
    rtcIntersect1: fn(Handle, *mut RtcRayHit, *const RtcArguments);
    rtcIntersect16: fn(*const c_int, Handle, *mut RtcRayHit16, *const RtcArguments);
    rtcOccluded1: fn(Handle, *mut RtcRay, *const RtcArguments);
}

/// The library.
pub(crate) struct Embree(Functions);

impl Embree {
    /// The library that `EMBREE_LIB` names; `None` where it is not set.
    pub(crate) fn of_environment() -> Result<Option<Self>, String> {
        let Some(path) = std::env::var_os("EMBREE_LIB") else {
            return Ok(None);
        };
        let bad = |e: libloading::Error| format!("EMBREE_LIB: {e}");
        // SAFETY: who sets EMBREE_LIB answers for what the library does when it is loaded; that it is
        // Embree 4 is asked below, before more than its device functions are called.
        let functions = unsafe { Functions::of(Library::new(&path).map_err(bad)?) }.map_err(bad)?;
        let embree = Arc::new(Self(functions));
        const VERSION: c_int = 0; // RTC_DEVICE_PROPERTY_VERSION: 10,000 × major + 100 × minor + patch
        let device = Device::new(&embree, 1)?;
        // SAFETY: the device lives.
        let version = unsafe { (embree.0.rtcGetDeviceProperty)(device.handle, VERSION) };
        if version / 10_000 != 4 {
            return Err(format!("EMBREE_LIB: version {version} is not 4.x"));
        }
        drop(device);
        Ok(Arc::into_inner(embree))
    }
}

/// The builders: fast and robust scenes of quality HIGH, which are traced, and MEDIUM, of which only the build
/// is of interest. HIGH splits triangles in space, but not in a robust scene: there Embree 4.4 builds what MEDIUM
/// builds, and tests with Plücker coordinates instead of Möller and Trumbore's.
pub(crate) fn makers(embree: &Arc<Embree>) -> Vec<Maker> {
    let maker = |name, quality, flags, traced: bool| {
        let embree = embree.clone();
        let build = move |geometry: &Arc<Geometry>, threads| {
            let device = Device::new(&embree, threads)?;
            /// `RTC_GEOMETRY_TYPE_TRIANGLE`.
            const TRIANGLE: c_int = 0;
            let mesh = triangles(geometry);
            // The spare last vertex is not counted, so that sixteen bytes can be read at any that is.
            let vertices = mesh.positions.len() - 1;
            let arrays = Arrays {
                kind: TRIANGLE,
                indices: (
                    0x5003,
                    mesh.triangles.as_ptr().cast(),
                    12,
                    mesh.triangles.len(),
                ),
                vertices: (0x9003, mesh.positions.as_ptr().cast(), 12, vertices),
            };
            let (scene, seconds) = Scene::build(device, &arrays, geometry.clone(), quality, flags)?;
            let bytes = scene.device.bytes.load(Ordering::Relaxed).max(0) as usize;
            let scene = Arc::new(scene);
            let mut peers: Vec<Box<dyn Peer>> = Vec::new();
            if traced {
                let packets = Packets(scene.clone(), name);
                peers = vec![Box::new(Single(scene, name)), Box::new(packets)];
            }
            Ok(Built {
                peers,
                seconds,
                bytes,
            })
        };
        Maker {
            name,
            traced,
            build: Box::new(build),
        }
    };
    vec![
        maker("Embree", HIGH, 0, true),
        maker("Embree robust", HIGH, ROBUST, true),
        maker("Embree medium", MEDIUM, 0, false),
    ]
}

/// The ways to trace round B-splines.
pub(crate) fn strands(
    embree: &Arc<Embree>,
    strands: &Arc<Strands>,
    threads: usize,
) -> Result<Built, String> {
    /// `RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE`.
    const ROUND_BSPLINE: c_int = 32;
    let (points, segments) = (&strands.points, &strands.segments);
    let device = Device::new(embree, threads)?;
    let arrays = Arrays {
        kind: ROUND_BSPLINE,
        indices: (0x5001, segments.as_ptr().cast(), 4, segments.len()),
        vertices: (0x9004, points.as_ptr().cast(), 16, points.len()),
    };
    let (scene, seconds) = Scene::build(device, &arrays, strands.clone(), HIGH, 0)?;
    let bytes = scene.device.bytes.load(Ordering::Relaxed).max(0) as usize;
    let scene = Arc::new(scene);
    let packets = Packets(scene.clone(), "Embree");
    let peers: Vec<Box<dyn Peer>> = vec![Box::new(Single(scene, "Embree")), Box::new(packets)];
    Ok(Built {
        peers,
        seconds,
        bytes,
    })
}

struct Device {
    embree: Arc<Embree>,
    handle: Handle,
    /// What the library holds by its own count.
    bytes: Box<AtomicIsize>,
}

// SAFETY: Embree's device functions may be called from any thread, and the others are atomic or immutable.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

/// Adds to the count that `counter` points to.
extern "C" fn count(counter: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: `Device::new` gave the address of its `bytes`, which outlives the library's device.
    let counter = unsafe { &*counter.cast::<AtomicIsize>() };
    counter.fetch_add(bytes, Ordering::Relaxed);
    true
}

impl Device {
    fn new(embree: &Arc<Embree>, threads: usize) -> Result<Self, String> {
        let settings = CString::new(format!("threads={threads}")).expect("it has no zero byte");
        // SAFETY: the settings are a string that ends in zero.
        let handle = unsafe { (embree.0.rtcNewDevice)(settings.as_ptr()) };
        if handle.is_null() {
            return Err("Embree made no device".to_owned());
        }
        let device = Self {
            embree: embree.clone(),
            handle,
            bytes: Box::default(),
        };
        let counter = (&raw const *device.bytes).cast_mut().cast();
        // SAFETY: the counter lives as long as the device.
        unsafe { (embree.0.rtcSetDeviceMemoryMonitorFunction)(handle, count, counter) };
        Ok(device)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is ours, and released once.
        unsafe { (self.embree.0.rtcReleaseDevice)(self.handle) };
    }
}

/// A buffer: format, rows, bytes of a row, and how many.
type Rows = (c_int, *const c_void, usize, usize);

/// What a geometry is made of.
struct Arrays {
    kind: c_int,
    indices: Rows,
    vertices: Rows,
}

/// A committed scene of one geometry.
struct Scene {
    handle: Handle,
    device: Device,
    /// Whose arrays the scene reads.
    _owner: Arc<dyn Send + Sync>,
}

// SAFETY: a committed scene is only read, which Embree allows from many threads.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Scene {
    /// The scene, and the seconds that committing it took. `owner` holds the arrays.
    fn build(
        device: Device,
        arrays: &Arrays,
        owner: Arc<dyn Send + Sync>,
        quality: c_int,
        flags: c_int,
    ) -> Result<(Self, f64), String> {
        /// `RTC_BUFFER_TYPE_INDEX` and `RTC_BUFFER_TYPE_VERTEX`.
        const INDICES: c_int = 0;
        const VERTICES: c_int = 1;
        let call = &device.embree.0;
        // SAFETY: the handles are those that the library gave, and each is released once. The buffers
        // stay with `_owner`, and sixteen bytes can be read at any vertex.
        let (handle, seconds, error) = unsafe {
            let scene = (call.rtcNewScene)(device.handle);
            (call.rtcSetSceneBuildQuality)(scene, quality);
            (call.rtcSetSceneFlags)(scene, flags);
            let shape = (call.rtcNewGeometry)(device.handle, arrays.kind);
            (call.rtcSetGeometryBuildQuality)(shape, quality);
            let share = |kind, (format, rows, bytes, count): Rows| {
                (call.rtcSetSharedGeometryBuffer)(shape, kind, 0, format, rows, 0, bytes, count);
            };
            share(VERTICES, arrays.vertices);
            share(INDICES, arrays.indices);
            (call.rtcCommitGeometry)(shape);
            (call.rtcAttachGeometry)(scene, shape);
            (call.rtcReleaseGeometry)(shape);
            let start = Instant::now();
            (call.rtcCommitScene)(scene);
            let seconds = start.elapsed().as_secs_f64();
            (scene, seconds, (call.rtcGetDeviceError)(device.handle))
        };
        let scene = Self {
            handle,
            device,
            _owner: owner,
        };
        match error {
            0 => Ok((scene, seconds)),
            error => Err(format!("Embree reports error {error}")),
        }
    }

    fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>) {
        let occluded = self.device.embree.0.rtcOccluded1;
        blocked.extend(rays.iter().map(|ray| {
            let mut ray = RtcRay::from(ray);
            // SAFETY: the scene is committed, the ray is ours, and no arguments stand for the defaults.
            unsafe { occluded(self.handle, &raw mut ray, null()) };
            ray.t_far < 0.0
        }));
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the handle is ours, and released once, before its device.
        unsafe { (self.device.embree.0.rtcReleaseScene)(self.handle) };
    }
}

impl From<&Ray> for RtcRay {
    #[inline]
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.to_array(),
            t_near: 0.0,
            direction: ray.direction.to_array(),
            time: 0.0,
            t_far: ray.t_max,
            mask: c_uint::MAX,
            id: 0,
            flags: 0,
        }
    }
}

/// A ray at a time, and what the scene is called.
struct Single(Arc<Scene>, &'static str);

impl Peer for Single {
    fn name(&self) -> String {
        self.1.to_owned()
    }

    fn closest(&self, batch: &Batch<'_>, hits: &mut Vec<Hit>) {
        let intersect = self.0.device.embree.0.rtcIntersect1;
        hits.extend(batch.rays.iter().map(|ray| {
            let mut met = RtcRayHit {
                ray: ray.into(),
                normal: [0.0; 3],
                u: 0.0,
                v: 0.0,
                primitive: NONE,
                geometry: NONE,
                instance: NONE,
                instance_primitive: NONE,
            };
            // SAFETY: as in `Scene::occluded`.
            unsafe { intersect(self.0.handle, &raw mut met, null()) };
            Hit {
                t: met.ray.t_far,
                u: met.u,
                v: met.v,
                instance: Hit::NONE,
                shape: met.geometry,
                primitive: met.primitive,
            }
        }));
    }

    fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>) {
        self.0.occluded(rays, blocked);
    }
}

/// Sixteen coherent rays at a time.
struct Packets(Arc<Scene>, &'static str);

impl Peer for Packets {
    fn name(&self) -> String {
        format!("{} ×16", self.1)
    }

    fn answers(&self, question: Question) -> bool {
        question == Question::Coherent
    }

    fn closest(&self, batch: &Batch<'_>, hits: &mut Vec<Hit>) {
        const VALID: Valid = Valid([-1; 16]);
        let intersect = self.0.device.embree.0.rtcIntersect16;
        let arguments = RtcArguments {
            flags: COHERENT,
            features: c_uint::MAX,
            context: null(),
            filter: null(),
            intersect: null(),
            min_width_distance_factor: 0.0,
        };
        for (packet, rays) in batch.packets.iter().zip(batch.rays.chunks(16)) {
            let mut met = RtcRayHit16 {
                origin: packet.origin,
                t_near: [0.0; 16],
                direction: packet.direction,
                time: [0.0; 16],
                t_far: packet.t_max,
                mask: [c_uint::MAX; 16],
                id: [0; 16],
                flags: [0; 16],
                normal: [[0.0; 16]; 3],
                u: [0.0; 16],
                v: [0.0; 16],
                primitive: [NONE; 16],
                geometry: [NONE; 16],
                instance: [NONE; 16],
                instance_primitive: [NONE; 16],
            };
            // SAFETY: as in `Scene::occluded`; packet and arguments live through the call.
            unsafe {
                intersect(
                    VALID.0.as_ptr(),
                    self.0.handle,
                    &raw mut met,
                    &raw const arguments,
                )
            };
            hits.extend((0..rays.len()).map(|i| Hit {
                t: met.t_far[i],
                u: met.u[i],
                v: met.v[i],
                instance: Hit::NONE,
                shape: met.geometry[i],
                primitive: met.primitive[i],
            }));
        }
    }

    fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>) {
        self.0.occluded(rays, blocked);
    }
}
