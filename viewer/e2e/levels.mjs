/**
 * Do readers that nobody here wrote open what is published? Reads each level of each model of each scene of a server, as it is
 * published and in its plain form, with Khronos' validator, three.js and glTF-Transform; no browser is needed for that. Fails on any
 * error of the validator, and where a level and its plain form do not fill the same box. Environment: see `browser.mjs`.
 */
import { GLB_BUFFER, NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import validator from "gltf-validator";
import { Box3 } from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { insist, tell, url as viewer } from "./browser.mjs";

/** So much of what is wrong is told. */
const MOST_TOLD = 20;
/** Where the server is. */
const base = viewer && new URL(viewer).origin;
const transform = new NodeIO()
  .registerExtensions(ALL_EXTENSIONS)
  .registerDependencies({ "meshopt.decoder": MeshoptDecoder });
// Pictures need a page; the geometry is what is looked at here.
const three = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
three.register(() => ({ name: "no_pictures", loadTexture: () => Promise.resolve(null) }));

async function bytesOf(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address}: ${response.status}`);
  return new Uint8Array(await response.arrayBuffer());
}

async function jsonOf(path) {
  return JSON.parse(new TextDecoder().decode(await bytesOf(`${base}${path}`)));
}

/** Every level once, by its address. */
async function levelsOf(scene, bounds) {
  const found = new Map();
  const box = [...bounds.min, ...bounds.max].map((x) => x.toFixed(6)).join(",");
  let next = `/v1/scenes/${scene}/objects?bbox=${box}&limit=1000`;
  while (next) {
    const page = await jsonOf(next);
    for (const { object, levels } of page.objects) {
      for (const { level, url } of levels) found.set(url, `/v1/scenes/${scene}/objects/${object}/lods/${level}`);
    }
    next = page.next;
  }
  return found;
}

async function errorsOf(address, glb) {
  const report = await validator.validateBytes(glb, {
    format: "glb",
    maxIssues: 100,
    externalResourceFunction: (uri) => bytesOf(new URL(uri, address)),
  });
  return report.issues.messages.filter(({ severity }) => severity === 0);
}

/** What glTF-Transform reads, pictures beside the GLB included; it takes none of those from a GLB by itself. */
async function documentOf(address, glb) {
  const view = new DataView(glb.buffer, glb.byteOffset, glb.byteLength);
  const jsonBytes = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + jsonBytes)));
  const resources = { [GLB_BUFFER]: glb.slice(28 + jsonBytes) };
  for (const { uri } of json.images ?? []) resources[uri] = await bytesOf(new URL(uri, address));
  return transform.readJSON({ json, resources });
}

/** The box that three.js puts around a level, after glTF-Transform has read it too. */
async function boxOf(address, glb) {
  const meshes = (await documentOf(address, glb)).getRoot().listMeshes().length;
  const { scene } = await three.parseAsync(glb.buffer, "");
  const box = new Box3().setFromObject(scene, true);
  if (box.isEmpty() !== (meshes === 0)) throw new Error(`${address}: three.js and glTF-Transform do not see the same`);
  return box;
}

/** What there is of all scenes, and what is wrong with it. */
async function readAll() {
  let [levels, bytes, plainBytes] = [0, 0, 0];
  const wrong = [];
  for (const { scene, bounds } of (await jsonOf("/v1/scenes")).scenes) {
    for (const [url, path] of await levelsOf(scene, bounds)) {
      const forms = [`${base}${url}`, `${base}${path}?form=plain`];
      const boxes = [];
      for (const address of forms) {
        const glb = await bytesOf(address);
        for (const { code, message, pointer } of await errorsOf(address, glb))
          wrong.push(`${address}: ${code} ${pointer} ${message}`);
        boxes.push(await boxOf(address, glb));
        if (address === forms[0]) bytes += glb.length;
        else plainBytes += glb.length;
      }
      const [published, plain] = boxes;
      const apart = Math.max(published.min.distanceTo(plain.min), published.max.distanceTo(plain.max));
      const size = published.min.distanceTo(published.max);
      if (apart > 1e-6 * (size + published.max.length())) wrong.push(`${path}: the plain form is ${apart} away`);
      levels += 1;
    }
  }
  return { levels, bytes, plainBytes, wrong };
}

await tell("levels", async () => {
  await MeshoptDecoder.ready;
  const { levels, bytes, plainBytes, wrong } = await readAll();
  for (const sentence of wrong.slice(0, MOST_TOLD)) console.error(sentence);
  insist(wrong.length === 0, `${wrong.length} things are wrong with ${levels} levels`);
  insist(levels > 0, "there are no levels");
  console.log(`others read ${levels} levels, ${bytes} bytes as published, ${plainBytes} plain`);
});
