// SPDX-License-Identifier: MIT
// The metal and the tools of some frames, turned with the mouse or a finger. `data` is what stirpost/solid.py packs.
function viewer(root, data) {
  "use strict";
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const box = root.querySelector(".canvas"), slider = root.querySelector("input[type=range]");
  const label = root.querySelector(".time"), choice = root.querySelector("select"), play = root.querySelector("button.play");
  const scale = root.querySelector(".scale"), withTool = root.querySelector("input[type=checkbox]");
  const places = mesh => {
    const q = new Uint16Array(bytes(mesh.points)), x = new Float32Array(q.length);
    for (let k = 0; k < q.length; k++) x[k] = data.low[k % 3] + q[k] / 65535 * (data.high[k % 3] - data.low[k % 3]);
    return x;
  };
  const geometry = mesh => {
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(places(mesh), 3));
    made.setIndex(new THREE.BufferAttribute(new Uint16Array(bytes(mesh.corners)), 1));
    made.computeVertexNormals();
    return made;
  };
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
  } catch (problem) {
    root.classList.add("none");
    return null;
  }
  box.appendChild(renderer.domElement);
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(28, 1, 0.001, 10);
  camera.up.set(0, 0, 1);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.75));
  const lamp = new THREE.DirectionalLight(0xffffff, 0.5);
  lamp.position.set(-0.5, -0.8, 1.6);
  scene.add(lamp);
  const metal = new THREE.Mesh(undefined, new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.DoubleSide}));
  const tool = new THREE.Mesh(undefined, new THREE.MeshLambertMaterial(
    {vertexColors: true, transparent: true, opacity: 0.55, side: THREE.DoubleSide, depthWrite: false}));
  scene.add(metal, tool);
  const middle = new THREE.Vector3(...[0, 1, 2].map(k => 0.5 * (data.metal[0][k] + data.metal[1][k])));
  const reach = Math.hypot(...[0, 1, 2].map(k => data.metal[1][k] - data.metal[0][k]));
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  controls.target.copy(middle);
  controls.enablePan = false;
  controls.minDistance = 0.3 * reach;
  controls.maxDistance = 5 * reach;
  const draw = () => { renderer.render(scene, camera); };
  controls.addEventListener("change", draw);
  const made = data.frames.map(() => null);
  const show = () => {
    const k = +slider.value, frame = data.frames[k], field = data.fields[choice.value];
    if (!made[k]) made[k] = [geometry(frame.metal), frame.tool ? geometry(frame.tool) : null];
    const values = new Uint8Array(bytes(frame.metal.values[field.name])), colours = new Float32Array(3 * values.length);
    values.forEach((v, n) => { for (let c = 0; c < 3; c++) colours[3 * n + c] = field.colours[3 * v + c] / 255; });
    made[k][0].setAttribute("color", new THREE.BufferAttribute(colours, 3));
    metal.geometry = made[k][0];
    tool.visible = withTool.checked && !!made[k][1];
    if (made[k][1]) {
      const stripe = new Uint8Array(bytes(frame.tool.stripe)), grey = new Float32Array(3 * stripe.length);
      stripe.forEach((v, n) => grey.fill(v ? 0.42 : 0.62, 3 * n, 3 * n + 3));
      made[k][1].setAttribute("color", new THREE.BufferAttribute(grey, 3));
      tool.geometry = made[k][1];
    }
    label.textContent = frame.time;
    const stops = [0, 64, 128, 192, 255].map(v => `rgb(${field.colours.slice(3 * v, 3 * v + 3)}) ${v / 2.55}%`);
    scale.innerHTML = `<span>${field.low}</span><i style="background:linear-gradient(90deg,${stops})"></i>` +
      `<span>${field.high}</span>`;
    draw();
  };
  const fit = () => {
    const wide = box.clientWidth, high = Math.round(Math.max(230, Math.min(520, 0.55 * wide)));
    renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    renderer.setSize(wide, high);
    camera.aspect = wide / high;
    camera.updateProjectionMatrix();
    draw();
  };
  camera.position.copy(middle).add(new THREE.Vector3(-0.55, -1.25, 0.95).multiplyScalar(0.98 * reach));
  controls.update();
  slider.max = data.frames.length - 1;
  slider.value = slider.max;
  data.fields.forEach((field, k) => choice.add(new Option(field.label, k)));
  let running = null;
  play.onclick = () => {
    if (running) { clearInterval(running); running = null; play.textContent = "play"; return; }
    play.textContent = "stop";
    running = setInterval(() => { slider.value = (+slider.value + 1) % data.frames.length; show(); }, 500);
  };
  slider.oninput = choice.onchange = withTool.onchange = show;
  window.addEventListener("resize", fit);
  show();
  fit();
  return {camera, controls, show};
}
