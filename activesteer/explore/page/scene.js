// Cars, road and cones in three dimensions. Axes are those of ISO 8855: x forward, y left, z up.
import * as THREE from "./three.module.min.js";
import { onTheme, paint, runColour, slippery } from "./look.js";

const CAMERA_BACK = 9.5, CAMERA_UP = 3.4, AHEAD = 3, SLOW_MPS = 1;
const SPREAD_BACK = 2, SPREAD_UP = 0.7; // Way of the camera backwards and upwards for each metre between the cars and their middle.
const BEHIND = 1e5; // Depth by which a car is drawn behind the one before it, so that the first is whole where they overlap; about 2 m.
const SLOW_MS = 50, LEAST_RATIO = 0.5;
const TRAIL_APART_M = 0.4, TRAIL_POINTS = 1500, ROAD_M = 1200, TILE_M = 10;

/* Without WebGL the page shows its curves and tracks; a sentence stands in the place of the cars. */
function rendererOn(canvas) {
  try {
    return new THREE.WebGLRenderer({ canvas, antialias: true });
  } catch {
    const told = document.createElement("p");
    told.textContent = "This browser has no WebGL, so the cars are not drawn in three dimensions.";
    canvas.after(told);
    canvas.style.display = "none";
    return { getPixelRatio: () => 0, setPixelRatio() {}, setSize() {}, render() {} };
  }
}

function shadeTexture() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d"), shade = pen.createRadialGradient(32, 32, 12, 32, 32, 32);
  shade.addColorStop(0, "rgba(0,0,0,.55)");
  shade.addColorStop(1, "rgba(0,0,0,0)");
  pen.fillStyle = shade;
  pen.fillRect(0, 0, 64, 64);
  return new THREE.CanvasTexture(canvas);
}

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = rendererOn(canvas);
    this.full = this.light = Math.min(devicePixelRatio, 2); // pixel ratios at rest and in motion
    this.renderer.setPixelRatio(this.full);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(48, 1.6, 0.3, 900);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b0a8, 2.6));
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(-30, 40, 60);
    this.scene.add(sun);
    this.asphalt = new THREE.CanvasTexture(document.createElement("canvas"));
    this.asphalt.wrapS = this.asphalt.wrapT = THREE.RepeatWrapping;
    this.asphalt.repeat.set(ROAD_M / TILE_M, ROAD_M / TILE_M);
    this.asphalt.anisotropy = 8;
    this.asphalt.colorSpace = THREE.SRGBColorSpace;
    this.ground = new THREE.Mesh(new THREE.PlaneGeometry(ROAD_M, ROAD_M), new THREE.MeshBasicMaterial({ map: this.asphalt, depthWrite: false }));
    this.ground.position.z = -0.02;
    this.ground.renderOrder = -3;
    this.shade = shadeTexture();
    this.scene.add(this.ground);
    this.cars = new Map();
    this.course = new THREE.Group();
    this.scene.add(this.course);
    this.surface = null;
    this.ground_m = 0;
    this.heading = null;
    onTheme(() => this.colours());
    this.colours();
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.fit();
  }

  colours() {
    this.stale = true;
    const sky = new THREE.Color(paint("sky"));
    this.scene.background = sky;
    this.scene.fog = new THREE.Fog(sky, 60, 420);
    this.pave();
    for (const car of this.cars.values()) for (const material of car.painted) material.color.set(runColour(car.place));
  }

  // A tile of the ground: grains, which show the speed, and a line at its edges, TILE_M apart.
  pave() {
    const canvas = this.asphalt.image, pen = canvas.getContext("2d");
    canvas.width = canvas.height = 256;
    pen.fillStyle = paint("ground");
    pen.fillRect(0, 0, 256, 256);
    let seed = 7;
    const next = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
    for (let i = 0; i < 900; i++) {
      pen.fillStyle = next() < 0.5 ? "rgba(255,255,255,.10)" : "rgba(0,0,0,.12)";
      pen.fillRect(256 * next(), 256 * next(), 3, 3);
    }
    pen.strokeStyle = paint("line");
    pen.globalAlpha = 0.55;
    pen.strokeRect(0, 0, 256, 256);
    this.asphalt.dispose();
    this.asphalt.needsUpdate = true;
  }

  fit() {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = width < height ? 62 : 48;
    this.camera.updateProjectionMatrix();
    this.stale = true;
  }

  // Draw fewer pixels on a machine that is slow, such as one without a graphics card.
  lighten(frame_ms) {
    this.frame_ms = Math.min(frame_ms, 500) * 0.1 + (this.frame_ms ?? 16) * 0.9;
    const ratio = this.renderer.getPixelRatio();
    if (this.frame_ms < SLOW_MS || ratio <= LEAST_RATIO) return;
    this.frame_ms = 16;
    this.light = Math.max(LEAST_RATIO, 0.6 * ratio);
    this.moving(true);
  }

  // Draw as many pixels as the machine can while the car drives, and all of them while it stands.
  moving(is) {
    this.renderer.setPixelRatio(is ? this.light : this.full);
    this.fit();
  }

  // Keep the shape of the cars: panels of the message and their points and normals.
  setShape(shape, arrays) {
    this.shape = shape;
    this.geometries = shape.panels.map((panel, i) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(arrays[2 * i].slice(), 3));
      geometry.setAttribute("normal", new THREE.BufferAttribute(arrays[2 * i + 1].slice(), 3));
      return geometry;
    });
    for (const name of [...this.cars.keys()]) this.remove(name);
  }

  car(name, place, opacity = 1) {
    if (this.cars.has(name)) return this.cars.get(name);
    const bodies = this.shape.bodies.map(() => new THREE.Group()), painted = [];
    this.shape.panels.forEach((panel, i) => {
      const colour = panel.rgb ? new THREE.Color().setRGB(...panel.rgb, THREE.SRGBColorSpace) : new THREE.Color(runColour(place));
      const material = new THREE.MeshPhongMaterial({ color: colour, shininess: 50, side: THREE.DoubleSide, transparent: opacity < 1, opacity, polygonOffset: true, polygonOffsetUnits: BEHIND * this.cars.size });
      if (!panel.rgb) painted.push(material);
      bodies[this.shape.bodies.indexOf(panel.body)].add(new THREE.Mesh(this.geometries[i], material));
    });
    const trail = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: runColour(place) }));
    trail.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * TRAIL_POINTS), 3));
    trail.geometry.setDrawRange(0, 0);
    trail.frustumCulled = false;
    painted.push(trail.material);
    const { front_m, rear_m, width_m } = this.shape.size, shadow = this.shadowOf(front_m - rear_m, width_m, (front_m + rear_m) / 2);
    this.scene.add(...bodies, trail, shadow);
    const car = { bodies, painted, place, trail, shadow, points: 0 };
    this.cars.set(name, car);
    return car;
  }

  remove(name) {
    const car = this.cars.get(name);
    if (!car) return;
    this.scene.remove(...car.bodies, car.trail, car.shadow);
    this.cars.delete(name);
    this.stale = true;
  }

  // Place the bodies of a car: 7 numbers each, position and quaternion w x y z, between two rows of poses.
  place(name, poses, row = 0, part = 0) {
    const car = this.cars.get(name), size = 7 * car.bodies.length;
    const next = Math.min(row + 1, poses.length / size - 1);
    car.bodies.forEach((body, i) => {
      const a = row * size + 7 * i, b = next * size + 7 * i;
      body.position.set(...[0, 1, 2].map((k) => poses[a + k] + part * (poses[b + k] - poses[a + k])));
      body.quaternion.set(poses[a + 4], poses[a + 5], poses[a + 6], poses[a + 3]);
      if (part) body.quaternion.slerp(new THREE.Quaternion(poses[b + 4], poses[b + 5], poses[b + 6], poses[b + 3]), part);
    });
    const [{ position, quaternion: q }] = car.bodies;
    car.shadow.position.set(position.x, position.y, this.surface ? position.z - poses[2] : 0);
    car.shadow.rotation.z = Math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z));
    this.stale = true;
  }

  // A soft dark patch on the ground; a real shadow would draw every car twice.
  shadowOf(length, width, ahead = 0) {
    const group = new THREE.Group(), patch = new THREE.Mesh(new THREE.PlaneGeometry(1.25 * length, 1.5 * width), new THREE.MeshBasicMaterial({ map: this.shade, transparent: true, depthWrite: false }));
    patch.position.set(ahead, 0, 0);
    patch.renderOrder = -1;
    group.add(patch);
    return group;
  }

  // The trail of a car up to here; it grows while the car drives, or is drawn whole from its poses.
  grow(name) {
    const car = this.cars.get(name), at = car.bodies[0].position, points = car.trail.geometry.getAttribute("position");
    const last = car.points ? Math.hypot(at.x - points.getX(car.points - 1), at.y - points.getY(car.points - 1)) : Infinity;
    if (last < TRAIL_APART_M) return;
    if (car.points === TRAIL_POINTS) { points.array.copyWithin(0, 3); car.points -= 1; }
    points.setXYZ(car.points, at.x, at.y, 0.03);
    car.points += 1;
    points.needsUpdate = true;
    car.trail.geometry.setDrawRange(0, car.points);
  }

  trail(name, poses, until) {
    const car = this.cars.get(name), size = 7 * car.bodies.length, points = car.trail.geometry.getAttribute("position");
    const every = Math.max(1, Math.ceil(until / TRAIL_POINTS));
    car.points = 0;
    for (let row = 0; row < until; row += every) points.setXYZ(car.points++, poses[row * size], poses[row * size + 1], 0.03 + (this.surface ? poses[row * size + 2] - poses[2] : 0));
    points.needsUpdate = true;
    car.trail.geometry.setDrawRange(0, car.points);
  }

  // A slippery road is lighter and bluer, as snow is.
  tint(mu) {
    this.ground.material.color.setRGB(1, 1, 1).lerp(new THREE.Color(1.5, 1.75, 2.1), slippery(mu));
    this.stale = true;
  }

  // The surface of an uneven road: corners, factors of their colours by height, and triangles; of a plane road nothing.
  // It writes no depth, because cars are drawn behind where they are.
  setSurface([corners, factors, triangles], ground_m) {
    this.ground_m = ground_m;
    if (this.surface) { this.scene.remove(this.surface); this.surface.geometry.dispose(); this.surface.material.dispose(); }
    this.surface = null;
    this.stale = true;
    if (!corners) return;
    const geometry = new THREE.BufferGeometry(), of = (values, size) => new THREE.BufferAttribute(values, size);
    geometry.setAttribute("position", of(corners.slice(), 3));
    geometry.setAttribute("color", of(factors.slice(), 3));
    geometry.setAttribute("uv", of(Float32Array.from({ length: corners.length / 3 * 2 }, (_, i) => corners[3 * (i >> 1) + i % 2] / ROAD_M + 0.5), 2));
    geometry.setIndex(of(new Uint32Array(triangles), 1));
    this.surface = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ map: this.asphalt, vertexColors: true, depthWrite: false }));
    this.surface.renderOrder = -2.5;
    this.surface.frustumCulled = false;
    this.scene.add(this.surface);
  }

  // An arrow above a cone, to the side on which to pass it.
  mark(cone) {
    if (!this.arrow) {
      const shape = new THREE.Shape([[0.1, -0.1], [0.8, -0.1], [0.8, -0.3], [1.4, 0], [0.8, 0.3], [0.8, 0.1], [0.1, 0.1]].map(([x, y]) => new THREE.Vector2(x, y)));
      this.arrow = new THREE.Mesh(new THREE.ShapeGeometry(shape), new THREE.MeshBasicMaterial({ color: 0x00a86b, side: THREE.DoubleSide }));
      this.scene.add(this.arrow);
    }
    this.arrow.visible = !!cone;
    if (!cone) return;
    this.arrow.position.set(cone.x, cone.y, 0.9);
    this.arrow.rotation.set(Math.PI / 2, cone.side * Math.PI / 2, 0);
  }

  setCourse({ cones, lanes, radius = 0, line = [], patches = [], mu = 0.9 }) {
    this.tint(mu);
    this.course.clear();
    this.cones = cones.map(([x, y]) => {
      const cone = new THREE.Mesh(new THREE.ConeGeometry(0.145, 0.5, 16), new THREE.MeshLambertMaterial({ color: 0xf07d00 }));
      cone.rotation.x = Math.PI / 2;
      cone.position.set(x, y, 0.25);
      const shadow = this.shadowOf(0.4, 0.34);
      shadow.position.set(x, y, 0);
      this.course.add(cone, shadow);
      return cone;
    });
    for (const { corners, mu: friction } of patches) {
      const shape = new THREE.Shape(corners.map(([x, y]) => new THREE.Vector2(x, y)));
      const patch = new THREE.Mesh(new THREE.ShapeGeometry(shape), new THREE.MeshBasicMaterial({ color: 0xa9cdf0, transparent: true, opacity: 0.55 * slippery(friction), depthWrite: false, side: THREE.DoubleSide }));
      patch.renderOrder = -3;
      patch.position.z = -0.01;
      this.course.add(patch);
    }
    for (const lane of lanes) {
      const length = lane.end_x_m - lane.start_x_m, width = lane.left_y_m - lane.right_y_m;
      const flat = new THREE.Mesh(new THREE.PlaneGeometry(length, width), new THREE.MeshBasicMaterial({ color: 0xfff2c0, transparent: true, opacity: 0.28, depthWrite: false }));
      flat.renderOrder = -2;
      flat.position.set(lane.start_x_m + length / 2, lane.right_y_m + width / 2, -0.005);
      this.course.add(flat);
    }
    for (let i = 0; i + 1 < line.length; i += 2) {  // dashes
      const [x, y] = line[i], ahead = line[i + 1][0] - x, left = line[i + 1][1] - y;
      const dash = new THREE.Mesh(new THREE.PlaneGeometry(Math.hypot(ahead, left), 0.2), new THREE.MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.7, depthWrite: false }));
      dash.renderOrder = -2;
      dash.rotation.z = Math.atan2(left, ahead);
      dash.position.set(x + ahead / 2, y + left / 2, 0);
      this.course.add(dash);
    }
    if (radius) {
      const ring = new THREE.Mesh(new THREE.RingGeometry(radius - 0.1, radius + 0.1, 128), new THREE.MeshBasicMaterial({ color: 0xffffff, transparent: true, depthWrite: false }));
      ring.renderOrder = -2;
      ring.position.set(0, radius, 0);
      this.course.add(ring);
    }
    this.heading = null;
    this.stale = true;
  }

  knock(index, sideways) {
    const cone = this.cones[index];
    if (!cone) return;
    cone.rotation.set(0, 0, sideways);
    cone.position.z = 0.12;
  }

  // Follow the velocity of cars, not their heading: a car that slides then turns in the picture. All of them stay in it.
  follow(names, velocity) {
    const places = names.map((name) => this.cars.get(name)?.bodies[0].position).filter(Boolean);
    if (!places.length) return;
    const middle = (key) => (Math.min(...places.map((place) => place[key])) + Math.max(...places.map((place) => place[key]))) / 2;
    const at = { x: middle("x"), y: middle("y") }, spread = Math.max(...places.map(({ x, y }) => Math.hypot(x - at.x, y - at.y)));
    const speed = Math.hypot(...velocity);
    const wanted = speed > SLOW_MPS ? Math.atan2(velocity[1], velocity[0]) : this.heading ?? 0;
    this.heading = wanted;  // at once: a camera that lags shows a car in a steady turn as one that slides
    const cos = Math.cos(this.heading), sin = Math.sin(this.heading);
    const back = CAMERA_BACK + SPREAD_BACK * spread;
    this.camera.position.set(at.x - 1.3 - back * cos, at.y - back * sin, CAMERA_UP + SPREAD_UP * spread);
    this.camera.lookAt(at.x + AHEAD * cos, at.y + AHEAD * sin, 0.6);
    this.ground.position.set(TILE_M * Math.round(at.x / TILE_M), TILE_M * Math.round(at.y / TILE_M), this.ground_m - 0.02);
    this.stale = true;
  }

  draw() {
    if (!this.stale) return;
    this.stale = false;
    this.renderer.render(this.scene, this.camera);
  }
}
