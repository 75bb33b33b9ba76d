import {
  BoxGeometry,
  BufferGeometry,
  Float32BufferAttribute,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Points,
  Raycaster,
  Vector3,
} from "three";
import { expect, it } from "vitest";
import { InstanceMesh } from "./instancemesh.ts";
import { batchedAt, type Drawn, ModelBatch } from "./modelbatch.ts";
import { ViewVolume } from "./viewvolume.ts";

const wall = () => new Mesh(new BoxGeometry(1, 1, 1), new MeshBasicMaterial());
const pane = () => new Mesh(new BoxGeometry(1, 1, 1), new MeshBasicMaterial({ transparent: true }));
const dots = () => {
  const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute([0, 0, 0], 3));
  return new Points(geometry);
};

const at = (x: number, z = -10) => new Matrix4().makeTranslation(x, 0, z);
const SHEAR = new Matrix4().makeShear(0.5, 0, 0, 0, 0, 0);
const MIRROR = new Matrix4().makeScale(1, -1, 1);

function look(batch: ModelBatch): void {
  const camera = new PerspectiveCamera(90, 1, 0.1, 100);
  camera.updateMatrixWorld();
  batch.look(new ViewVolume(camera));
}

/** How many instances, and how many nodes of their own, are drawn. */
function drawn(batch: ModelBatch): [instances: number, alone: number] {
  look(batch);
  const instanced = batch.root.children.filter((node) => node instanceof InstanceMesh);
  const instances = instanced.reduce((sum, { visible, count }) => sum + (visible ? count : 0), 0);
  return [instances, batch.root.children.length - instanced.length];
}

function batchOf(...parts: Drawn[]): ModelBatch {
  return new ModelBatch(parts);
}

it("what is opaque is drawn together, and by itself what is seen through and what has no faces", () => {
  const batch = batchOf(wall(), pane(), dots());
  for (const x of [-4, 0, 4]) batch.stand(x, at(x));
  expect(drawn(batch)).toEqual([3, 6]);
  const [alone] = batch.root.children.filter((node) => node instanceof Points);
  expect(new Vector3().setFromMatrixPosition((alone as Points).matrixWorld).toArray()).toEqual([-4, 0, -10]);
  batch.remove(-4);
  expect(drawn(batch)).toEqual([2, 4]);
});

it("what is sheared is drawn by itself, and together again when it is not sheared any more", () => {
  const batch = batchOf(wall(), pane());
  for (const object of [1, 2]) batch.stand(object, at(object));
  batch.stand(1, at(1).multiply(SHEAR));
  expect(drawn(batch)).toEqual([1, 3]);
  batch.stand(1, at(5));
  expect(drawn(batch)).toEqual([2, 2]);
  const panes = batch.root.children.filter((node) => !(node instanceof InstanceMesh));
  expect(panes.map(({ matrixWorld }) => matrixWorld.elements[12]).sort()).toEqual([2, 5]);
});

it("what is mirrored is drawn by another mesh, and once only", () => {
  const batch = batchOf(wall());
  batch.stand(1, at(1));
  batch.stand(2, at(2).multiply(MIRROR));
  expect([drawn(batch), batch.root.children.length]).toEqual([[2, 0], 2]);
  expect(batch.root.children.map(({ matrixWorld }) => Math.sign(matrixWorld.determinant()))).toEqual([1, -1]);
  batch.stand(2, at(2));
  expect(drawn(batch)).toEqual([2, 0]);
  batch.remove(2);
  expect(drawn(batch)).toEqual([1, 0]);
});

it("a ray tells which object it has met, however that is drawn", () => {
  const batch = batchOf(wall(), pane());
  batch.stand(11, at(0, -10));
  batch.stand(12, at(5, -10).multiply(SHEAR));
  batch.stand(13, at(-5, -10).multiply(MIRROR));
  const met = (x: number) => {
    const hits = new Raycaster(new Vector3(x, 0, 0), new Vector3(0, 0, -1)).intersectObject(batch.root, true);
    return [...new Set(hits.map(batchedAt))];
  };
  expect([met(0), met(5), met(-5), met(9)]).toEqual([[11], [12], [13], []]);
});
