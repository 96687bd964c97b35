"""Mitsuba's side of `etendue crosscheck`: loads a scene and renders it once for each seed that it is told.

The program starts this with an order, one line of JSON, on standard input, and then writes seeds, one a
line. Each gets one line of JSON on standard output: {"loaded": …} or {"refused": …} for the order, and
{"rendered": …} for a seed. The end of the input ends it. It needs nothing but the package `mitsuba`.
"""
import importlib.util
import json
import os
import random
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

TAGS = {'ReconstructionFilter': 'rfilter', 'PhaseFunction': 'phase'}

REGISTRIES = {'register_bsdf': 'BSDF', 'register_emitter': 'Emitter', 'register_film': 'Film',
              'register_integrator': 'Integrator', 'register_medium': 'Medium', 'register_phase': 'PhaseFunction',
              'register_rfilter': 'ReconstructionFilter', 'register_sampler': 'Sampler', 'register_sensor': 'Sensor',
              'register_shape': 'Shape', 'register_texture': 'Texture'}


CROP = ('crop_offset_x', 'crop_offset_y', 'crop_width', 'crop_height')

# What stays where one plugin takes another's place, and integrators that do not read all of it.
SHARED = {'sample_count', 'seed', 'max_depth', 'rr_depth', 'hide_emitters'}
WITHOUT_DEPTH = {'aov', 'depth', 'direct', 'moment'}


class Refused(Exception):
    """The scene asks for what Mitsuba does not have."""


class Clock:
    """Seconds since it was made, of the wall and of all threads of this process."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def time(self):
        return {'seconds': time.perf_counter() - self.wall, 'cpu': time.process_time() - self.cpu}


def import_plugins(mi, folder, own):
    """Runs every Python file of a folder: each registers what it adds to Mitsuba. The answer is the kinds of
    what it adds by name, for Mitsuba's own list tells those of `scalar_rgb` alone. Of Étendue's own, one that lacks
    a package is passed over: most scenes do not ask for it."""
    kinds = {}

    def listed(name, register, kind):
        def also(plugin, make):
            kinds[plugin] = kind
            return register(plugin, make)
        setattr(mi, name, also)

    for name, kind in REGISTRIES.items():
        listed(name, getattr(mi, name), getattr(mi.ObjectType, kind))
    sys.path.insert(0, str(folder))
    for path in sorted(Path(folder).glob('*.py')):
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules.setdefault(path.stem, module)
        try:
            spec.loader.exec_module(module)
        except ModuleNotFoundError as error:
            if not own:
                raise
            print(f'{path.name} is left out: {error}', file=sys.stderr)
    return kinds


class Motion:
    """The keyframes of a scene, which Mitsuba 3.9 does not read. It renders the scene as it stands at one time after
    another, for what `<animation>` says at that time takes its place in the text."""

    NAME = 'etendue_motion_'

    def __init__(self, mi, order):
        import numpy
        self.mi, self.numpy, self.config = mi, numpy, mi.parser.ParserConfig(order['variant'])
        root = ElementTree.parse(order['scene']).getroot()
        self.values = {e.get('name'): e.get('value') for e in root.iter('default')} | dict(order['defines'])
        self.tracks = []
        for parent in list(root.iter()):
            for place, element in enumerate(list(parent)):
                if element.tag != 'animation':
                    continue
                self.tracks.append([(float(self.filled(frame.get('time'))), self.pose(frame, root.get('version')))
                                    for frame in element])
                still = ElementTree.Element('transform', name=element.get('name'))
                ElementTree.SubElement(still, 'matrix', value=f'${self.NAME}{len(self.tracks) - 1}')
                parent[place] = still
        self.text = ElementTree.tostring(root, encoding='unicode')

    def filled(self, text):
        """A text with its parameters' values."""
        for name in sorted(self.values, key=len, reverse=True):
            text = text.replace('$' + name, self.values[name])
        return text

    def pose(self, frame, version):
        """Scale, rotation as a quaternion, and translation of a keyframe, whose operations Mitsuba reads itself."""
        np = self.numpy
        operations = ''.join(ElementTree.tostring(e, encoding='unicode') for e in frame)
        text = (f'<scene version="{version}"><emitter type="point"><transform name="to_world">'
                f'{self.filled(operations)}</transform></emitter></scene>')
        state = self.mi.parser.parse_string(self.config, text)
        points = [node.props for node in state.nodes if node.props.plugin_name() == 'point']
        matrix = np.array(points[0]['to_world'].matrix, dtype=float).reshape(4, 4)
        left, _, right = np.linalg.svd(matrix[:3, :3])
        rotation = left @ right
        if np.linalg.det(rotation) < 0:
            rotation = -rotation
        scale = rotation.T @ matrix[:3, :3]
        # The eigenvector of the largest eigenvalue (Bar-Itzhack, 2000).
        (a, b, c), (d, e, f), (g, h, i) = rotation
        k = np.array([[a - e - i, d + b, g + c, h - f], [d + b, e - a - i, h + f, c - g],
                      [g + c, h + f, i - a - e, d - b], [h - f, c - g, d - b, a + e + i]])
        x, y, z, w = np.linalg.eigh(k)[1][:, -1]
        return scale, np.array([w, x, y, z]), matrix[:3, 3]

    def matrix(self, track, time):
        """A track's matrix at a time, as text."""
        np = self.numpy
        times = [t for t, _ in track]
        last = len(track) - 1
        key = min(max(int(np.searchsorted(times, time, side='right')) - 1, 0), max(last - 1, 0))
        following = min(key + 1, last)
        span = times[following] - times[key]
        part = min(max((time - times[key]) / span, 0.0), 1.0) if span > 0 else 0.0
        (scale0, turn0, move0), (scale1, turn1, move1) = track[key][1], track[following][1]
        cosine = float(turn0 @ turn1)
        turn1, cosine = (-turn1, -cosine) if cosine < 0 else (turn1, cosine)
        angle = np.arccos(min(cosine, 1.0))
        if angle < 1e-6:
            turn = turn0 + (turn1 - turn0) * part
        else:
            turn = (np.sin((1 - part) * angle) * turn0 + np.sin(part * angle) * turn1) / np.sin(angle)
        w, x, y, z = turn / np.linalg.norm(turn)
        rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                             [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                             [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        matrix = np.identity(4)
        matrix[:3, :3] = rotation @ (scale0 + (scale1 - scale0) * part)
        matrix[:3, 3] = move0 + (move1 - move0) * part
        return ' '.join(repr(float(value)) for value in matrix.flatten())

    def at(self, order, time):
        """The order for the scene as it stands at a time, and the scene's text."""
        values = [[f'{self.NAME}{i}', self.matrix(track, time)] for i, track in enumerate(self.tracks)]
        return {**order, 'defines': order['defines'] + values, 'text': self.text}


class Parsed:
    """A scene file as Mitsuba's parser leaves it, before anything is built. Nodes are known by number."""

    def __init__(self, mi, order, added):
        self.mi, self.variant, self.added = mi, order['variant'], added
        mi.file_resolver().prepend(str(Path(order['scene']).resolve().parent))
        self.config = mi.parser.ParserConfig(order['variant'])
        if 'text' in order:
            self.state = mi.parser.parse_string(self.config, order['text'], **dict(order['defines']))
        else:
            self.state = mi.parser.parse_file(self.config, order['scene'], **dict(order['defines']))
        mi.parser.transform_upgrade(self.config, self.state)
        mi.parser.transform_resolve(self.config, self.state)
        self.notes = []

    def props(self, node):
        return self.state.nodes[node].props

    def is_a(self, node, kind):
        return self.state.nodes[node].type == getattr(self.mi.ObjectType, kind)

    def all(self, kind):
        return [node for node in range(len(self.state.nodes)) if self.is_a(node, kind)]

    def children(self, parent, kind):
        props = self.props(parent)
        values = [props[name] for name in props.keys()]
        found = [v.index() for v in values if isinstance(v, self.mi.Properties.ResolvedReference)]
        return [node for node in found if self.is_a(node, kind)]

    def child(self, parent, kind, plugin):
        """The first child of a kind, made with this plugin where there is none."""
        for child in self.children(parent, kind):
            return child
        node = self.mi.parser.SceneNode()
        node.type = getattr(self.mi.ObjectType, kind)
        node.props = self.mi.Properties(plugin)
        self.state.nodes.append(node)
        added = len(self.state.nodes) - 1
        self.props(parent)['etendue_' + plugin] = self.mi.Properties.ResolvedReference(added)
        return added

    def kind(self, plugin):
        """What kind of plugin has this name, `Unknown` where none has."""
        return self.added.get(plugin) or self.mi.PluginManager.instance().plugin_type(plugin)

    def exists(self, node):
        return self.kind(self.props(node).plugin_name()) != self.mi.ObjectType.Unknown

    def disambiguate(self):
        """Mitsuba keeps plugins of all kinds under one set of names: where the plugin of an integrator's name is of
        another kind, the integrator is looked for under the name with `_integrator`."""
        wanted = self.mi.ObjectType.Integrator
        for node in self.all('Integrator'):
            name = self.props(node).plugin_name()
            if self.kind(name) != wanted and self.kind(f'{name}_integrator') == wanted:
                self.props(node).set_plugin_name(f'{name}_integrator')

    def replace_samplers(self):
        """How points are placed changes the noise and not the mean: `independent` stands in for the rest."""
        for node in self.all('Sampler'):
            if self.exists(node):
                continue
            props, other = self.props(node), self.mi.Properties('independent')
            self.notes.append(f'Mitsuba has no sampler "{props.plugin_name()}" and takes independent points')
            if 'sample_count' in props:
                other['sample_count'] = props['sample_count']
            self.state.nodes[node].props = other

    def refuse_missing(self):
        """Raises `Refused` with every plugin that is not there."""
        missing = []
        for node in range(len(self.state.nodes)):
            if not self.exists(node):
                kind = self.state.nodes[node].type.name
                what = f'{TAGS.get(kind, kind.lower())} "{self.props(node).plugin_name()}"'
                if what not in missing:
                    missing.append(what)
        if missing:
            raise Refused('Mitsuba has no ' + ' and no '.join(missing))

    def override(self, order):
        """Puts the order's values where the scene's stand, as `etendue render` does with its options."""
        root = 0
        integrator = self.child(root, 'Integrator', 'path')
        if order['integrator'] is not None:
            self.replace(integrator, order['integrator'])
        if order['max_depth'] is not None:
            while self.children(integrator, 'Integrator'):
                integrator = self.children(integrator, 'Integrator')[0]
            self.props(integrator)['max_depth'] = order['max_depth']
        for sensor in self.children(root, 'Sensor'):
            if order['shutter'] is not None:
                self.props(sensor)['shutter_open'], self.props(sensor)['shutter_close'] = order['shutter']
            film = self.child(sensor, 'Film', 'hdrfilm')
            if order['size'] is not None:
                self.props(film)['width'], self.props(film)['height'] = order['size']
            if order['crop'] is not None:
                for name, value in zip(CROP, order['crop']):
                    self.props(film)[name] = value
            sampler = self.child(sensor, 'Sampler', 'independent')
            if order['sampler'] is not None:
                self.replace(sampler, order['sampler'])
            if order['spp'] is not None:
                self.props(sampler)['sample_count'] = order['spp']

    def show_emitters(self):
        """Mitsuba 3.9.1 crashes in scalar variants where `path` looks through emitters and a camera ray meets an
        instance. Étendue's side does the same (`serve.rs`)."""
        shapes = [self.props(node).plugin_name() for node in self.all('Shape')]
        if not self.variant.startswith('scalar') or 'instance' not in shapes:
            return
        for node in self.all('Integrator'):
            props = self.props(node)
            if props.plugin_name() == 'path' and 'hide_emitters' in props and props['hide_emitters']:
                props['hide_emitters'] = False
                self.notes.append('emitters are shown: Mitsuba crashes where path hides them and there are instances')

    def replace(self, node, plugin):
        """Makes a node another plugin, which keeps of the properties what both read."""
        props, other = self.props(node), self.mi.Properties(plugin)
        if plugin == props.plugin_name():
            return
        shared = SHARED - {'max_depth', 'rr_depth'} if plugin in WITHOUT_DEPTH else SHARED
        for name in props.keys():
            if name in shared or isinstance(props[name], self.mi.Properties.ResolvedReference):
                other[name] = props[name]
        self.state.nodes[node].props = other

    def sensor(self, wanted):
        """The number of the sensor that is meant by its id or, where none has it, by its number."""
        ids = [self.props(node).id() for node in self.children(0, 'Sensor')]
        if wanted is None:
            return 0
        if wanted in ids:
            return ids.index(wanted)
        if wanted.isdecimal() and int(wanted) < len(ids):
            return int(wanted)
        raise Refused(f'Mitsuba finds no sensor "{wanted}" in the file')

    def build(self):
        # What `mi.load_file` does too. It puts the whole scene into one node, so it comes last.
        self.mi.parser.transform_merge_equivalent(self.config, self.state)
        self.mi.parser.transform_merge_meshes(self.config, self.state)
        built = self.mi.parser.instantiate(self.config, self.state)
        scene = built[0] if isinstance(built, list) else built
        if not isinstance(scene, self.mi.Scene) or not scene.sensors():
            raise Refused('Mitsuba finds no scene with a sensor in the file')
        integrator = type(scene.integrator())
        if self.variant.startswith('scalar') and not integrator.__module__.startswith('mitsuba'):
            raise Refused(f'Mitsuba cannot run {integrator.__name__}, an integrator written in Python, in a variant '
                          'of one ray at a time; take one such as llvm_ad_rgb (--variant)')
        return scene


def load(mi, order, added):
    """The scene, the number of the sensor that is meant, and what was done to the scene."""
    try:
        parsed = Parsed(mi, order, added)
        sensor = parsed.sensor(order['sensor'])
        parsed.override(order)
        parsed.show_emitters()
        parsed.disambiguate()
        parsed.replace_samplers()
        parsed.refuse_missing()
        return parsed.build(), sensor, parsed.notes
    except Refused:
        raise
    except Exception as error:
        raise Refused(f'Mitsuba refuses the scene: {error}') from error


def write(bitmap, path):
    """Writes an EXR. In a pool of one thread Mitsuba's encoder waits for ever for somebody else to do the work."""
    import drjit
    count = drjit.thread_count()
    if count < 2:
        drjit.set_thread_count(2)
    bitmap.write(path)
    if count < 2:
        drjit.set_thread_count(count)


# As many times of a shutter are rendered as there are samples a pixel, and no more than that.
MOST_TIMES = 256


class Renderer:
    """A scene in memory; where it moves, as it stands at one time after another."""

    def __init__(self, mi, order, added):
        self.mi, self.order, self.added = mi, order, added
        self.motion = None
        if '<animation' in Path(order['scene']).read_text(encoding='utf-8'):
            try:
                self.motion = Motion(mi, order)
            except ModuleNotFoundError as error:
                raise Refused(f'a scene that moves needs the Python package {error.name}') from error
        self.scene, self.chosen, self.notes = self.load(0.0)
        self.spp = self.sensor().sampler().sample_count()
        self.times = 1
        if self.motion is not None:
            shutter = self.shutter()
            while shutter[0] < shutter[1] and self.times < MOST_TIMES and self.spp % (2 * self.times) == 0:
                self.times *= 2
            self.notes.append(f'Mitsuba renders the scene at {self.times} times and takes the mean')

    def load(self, time, times=1):
        order = self.order if self.motion is None else self.motion.at(self.order, time)
        if times > 1:
            order = {**order, 'spp': self.spp // times}
        return load(self.mi, order, self.added)

    def sensor(self):
        return self.scene.sensors()[self.chosen]

    def shutter(self):
        opened = self.sensor().shutter_open()
        return opened, opened + self.sensor().shutter_open_time()

    def render(self, seed):
        if self.motion is None:
            return self.still(seed)
        opened, closed = self.shutter()
        draw = random.Random(seed)
        total = None
        for number in range(self.times):
            time = opened + (closed - opened) * (number + draw.random()) / self.times
            self.scene, self.chosen, _ = self.load(time, self.times)
            bitmap = self.still((seed * self.times + number) % 2**32)
            # Sums and weights: the mean of quotients would be another thing.
            raw = self.motion.numpy.array(self.sensor().film().bitmap(raw=True), dtype=float)
            total = raw if total is None else total + raw
        image = (total[..., :-1] / total[..., -1:]).astype('float32')
        names = [field.name for field in bitmap.struct_()]
        if image.shape[-1] != len(names):
            raise Refused('a scene that moves cannot be put together from these channels')
        return self.mi.Bitmap(image, pixel_format=bitmap.pixel_format(), channel_names=names)

    def still(self, seed):
        self.scene.integrator().render(self.scene, sensor=self.chosen, seed=seed, develop=False)
        return self.sensor().film().bitmap()


def main():
    # What Mitsuba prints goes to standard error: the answers have the standard output to themselves.
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)

    def answer(kind, content):
        answers.write(json.dumps({kind: content}) + '\n')
        answers.flush()

    order = json.loads(sys.stdin.readline())
    import mitsuba as mi
    if order['variant'] not in mi.variants():
        return answer('refused', f'Mitsuba {mi.__version__} has no variant "{order["variant"]}"; there are '
                      + ', '.join(mi.variants()))
    mi.set_variant(order['variant'])
    mi.set_log_level(mi.LogLevel.Error)
    if order['threads'] is not None:
        import drjit
        drjit.set_thread_count(order['threads'])
    added = import_plugins(mi, order['plugins'], order['own_plugins'])

    clock = Clock()
    try:
        renderer = Renderer(mi, order, added)
    except Refused as error:
        return answer('refused', str(error))
    answer('loaded', dict(renderer=f'Mitsuba {mi.__version__}, {order["variant"]}', time=clock.time(),
                          notes=renderer.notes))
    for line in sys.stdin:
        seed = int(line)
        clock = Clock()
        bitmap = renderer.render(seed)
        taken = clock.time()
        path = str(Path(order['folder']) / f'mitsuba-{seed}.exr')
        write(bitmap, path)
        answer('rendered', dict(image=path, spp=renderer.spp, time=taken))


if __name__ == '__main__':
    try:
        main()
    except BaseException:
        import traceback
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    # Nothing of the interpreter's way out is of interest, and Mitsuba may hang there.
    sys.stderr.flush()
    os._exit(0)
