//! Images in tev (<https://github.com/Tom94/tev>) while they are rendered: linear, with all channels, as an EXR file would
//! hold them. A thread of its own sends them, so that no render waits for a slow viewer: of the pictures of one image the
//! last alone is sent, and a viewer that goes away is warned of, once.

mod packet;

use std::collections::VecDeque;
use std::io::{self, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use etendue::error::{Error, Result};
use etendue::image::Image;

use super::progress::Voice;

/// How long a viewer may take to accept a connection, and then anything at all of what is sent.
const PATIENCE: Duration = Duration::from_secs(10);
/// A finished image waits for those before it while so many wait.
const MOST_WAITING: usize = 2;

const HELP: &str =
    "start tev first; it listens at 127.0.0.1:14158 unless its option --host names another place";

/// A viewer that takes images.
#[derive(Debug)]
pub(super) struct Viewer {
    queue: Arc<Queue>,
    thread: JoinHandle<()>,
}

/// What waits to be sent.
#[derive(Debug, Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    /// Something came, went or ended.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    pictures: VecDeque<Named>,
    /// Nothing more comes.
    complete: bool,
    /// Nobody takes anything any more.
    gone: bool,
}

/// An image and its name in the viewer.
#[derive(Debug)]
struct Named {
    name: String,
    image: Image,
}

const CALM: &str = "no thread panics while it holds the queue";

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().expect(CALM)
    }

    fn wait<'a>(&self, waiting: MutexGuard<'a, Waiting>) -> MutexGuard<'a, Waiting> {
        self.changed.wait(waiting).expect(CALM)
    }

    /// The next picture, when there is one; `None` where nothing more comes.
    fn next(&self) -> Option<Named> {
        let mut waiting = self.lock();
        loop {
            if let Some(next) = waiting.pictures.pop_front() {
                self.changed.notify_all();
                return Some(next);
            }
            if waiting.complete {
                return None;
            }
            waiting = self.wait(waiting);
        }
    }
}

impl Viewer {
    /// Connects to the tev that listens at `address`, a host and a port. `voice` tells where it goes away.
    ///
    /// # Errors
    /// Where nobody listens there.
    pub(super) fn connect(address: &str, voice: Voice) -> Result<Self> {
        let place = format!("tev at {address}");
        let mut stream = open(address)
            .map_err(|e| Error::system("connect to", Path::new(&place), &e).help(HELP))?;
        let queue = Arc::new(Queue::default());
        let thread = {
            let queue = Arc::clone(&queue);
            thread::spawn(move || {
                if let Err(error) = send_all(&queue, &mut stream) {
                    let mut waiting = queue.lock();
                    waiting.gone = true;
                    waiting.pictures.clear();
                    queue.changed.notify_all();
                    drop(waiting);
                    let why = match error.kind() {
                        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                            format!("it took nothing for {} seconds", PATIENCE.as_secs())
                        }
                        _ => error.to_string(),
                    };
                    let message = format!("{place} shows no more images: {why}");
                    voice.warn(&Error::input(message).help("the render goes on without it"));
                }
            })
        };
        Ok(Self { queue, thread })
    }

    /// Shows the image of this name as it stands, which takes the place of what was to be shown of it.
    pub(super) fn show(&self, name: &str, image: &Image) {
        let mut waiting = self.queue.lock();
        if waiting.gone {
            return;
        }
        let picture = Named {
            name: name.to_owned(),
            image: image.clone(),
        };
        match waiting.pictures.back_mut().filter(|last| last.name == name) {
            Some(last) => *last = picture,
            None => waiting.pictures.push_back(picture),
        }
        self.queue.changed.notify_all();
    }

    /// Shows the finished image of this name. Where the viewer is still busy with finished images it waits for them.
    pub(super) fn finish(&self, name: &str, image: &Image) {
        self.show(name, image);
        let mut waiting = self.queue.lock();
        while waiting.pictures.len() > MOST_WAITING {
            waiting = self.queue.wait(waiting);
        }
    }

    /// Waits until everything is sent.
    pub(super) fn close(self) {
        self.queue.lock().complete = true;
        self.queue.changed.notify_all();
        // That it panicked is on standard error, and the images are written.
        let _ = self.thread.join();
    }
}

/// Connects to the first of the addresses that takes a connection.
fn open(address: &str) -> io::Result<TcpStream> {
    let mut refused = io::Error::new(io::ErrorKind::NotFound, "no such host");
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

/// Sends what comes until nothing more does.
fn send_all(queue: &Queue, stream: &mut TcpStream) -> io::Result<()> {
    let mut created: Option<String> = None;
    while let Some(Named { name, image }) = queue.next() {
        if created.as_ref() != Some(&name) {
            stream.write_all(&packet::create(&name, &image)?)?;
        }
        for rows in packet::bands(&image) {
            stream.write_all(&packet::update(&name, &image, rows)?)?;
        }
        created = Some(name);
    }
    Ok(())
}
