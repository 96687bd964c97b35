#!/usr/bin/env python3
"""Renders glTF files with three.js in headless Chromium: what a viewer shows, to hold Étendue's pictures of bare glTF
files against. The file's first camera is looked through and its own lights light it, without an environment, without tone
mapping and without shadows; `--matte` leaves the base colours alone of the materials (Lambert's).

  npm install --prefix target/three three@0.187
  $(tools/venv page) tools/gltf/viewer.py [--matte] [--size WxH] MODEL.glb OUT.png [MODEL OUT]…
"""
import argparse
import base64
import functools
import http.server
import shutil
import threading
from pathlib import Path
from urllib.parse import unquote

from playwright.sync_api import sync_playwright

THREE = Path(__file__).resolve().parents[2] / "target/three/node_modules/three"

PAGE = """<!doctype html><link rel="icon" href="data:,"><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}
</script><script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
window.show = async (url, width, height, matte, time) => {
  const gltf = await new GLTFLoader().loadAsync(url);
  const scene = new THREE.Scene();
  scene.add(gltf.scene);
  if (gltf.animations.length && time !== null) {
    const mixer = new THREE.AnimationMixer(gltf.scene);
    mixer.clipAction(gltf.animations[0]).play();
    mixer.setTime(time);
  }
  scene.updateMatrixWorld(true);
  const camera = gltf.cameras[0];
  if (!camera) throw new Error("the file has no camera");
  if (camera.isPerspectiveCamera) camera.aspect = width / height;
  camera.updateProjectionMatrix();
  if (matte) scene.traverse(node => {
    if (!node.isMesh) return;
    const { color, map, vertexColors, side, flatShading } = node.material;
    node.material = new THREE.MeshLambertMaterial({ color, map, vertexColors, side, flatShading: flatShading ?? false });
  });
  renderer.setPixelRatio(1);
  renderer.setSize(width, height);
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL("image/png");
};
window.ready = true;
</script>"""


class Handler(http.server.SimpleHTTPRequestHandler):
    """The page, three.js and the folders of the models."""

    def __init__(self, *args, roots, **kwargs):
        self.roots = roots
        super().__init__(*args, **kwargs)

    def translate_path(self, path):
        first, _, rest = path.split("?")[0].lstrip("/").partition("/")
        return str(self.roots.get(first, Path("/nowhere")) / unquote(rest))

    def do_GET(self):
        if self.path != "/":
            return super().do_GET()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(PAGE.encode())

    def log_message(self, *_):
        pass


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="MODEL OUT")
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--matte", action="store_true")
    parser.add_argument("--time", type=float, help="of the first animation, in seconds")
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    pairs = list(zip(args.files[::2], args.files[1::2], strict=True))
    roots = {str(i): model.resolve().parent for i, (model, _) in enumerate(pairs)} | {"three": THREE}
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, roots=roots))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
        )
        page = browser.new_page()
        page.on("console", lambda message: print(f"three.js: {message.text}"))
        page.goto(f"http://127.0.0.1:{server.server_port}/")
        page.wait_for_function("window.ready")
        for i, (model, out) in enumerate(pairs):
            shot = page.evaluate("a => show(...a)", [f"/{i}/{model.name}", width, height, args.matte, args.time])
            out.write_bytes(base64.b64decode(shot.partition(",")[2]))
        browser.close()


main()
