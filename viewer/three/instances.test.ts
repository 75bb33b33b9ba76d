import { BoxGeometry, Group, Matrix4, Mesh, MeshBasicMaterial, PerspectiveCamera, Raycaster, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { InstanceMesh } from "./instancemesh.ts";
import { Instances } from "./instances.ts";
import { ViewVolume } from "./viewvolume.ts";

/** Along −z, turned to the left. */
function viewTo(yaw = 0, x = 0): ViewVolume {
  const camera = new PerspectiveCamera(60, 1, 0.1, 100);
  camera.rotation.y = yaw;
  camera.position.x = x;
  camera.updateMatrixWorld();
  return new ViewVolume(camera);
}

const at = (x: number, z: number) => new Matrix4().makeTranslation(x, 0, z);

/** A model of boxes at these places in it, and what is drawn of it. */
function model(...places: Matrix4[]) {
  const parts = places.map((place) => {
    const part = new Mesh(new BoxGeometry(1, 1, 1), new MeshBasicMaterial());
    part.matrixWorld.copy(place);
    return part;
  });
  const root = new Group();
  return { parts, root, meshes: () => root.children as InstanceMesh[] };
}

/** Where the instances of a mesh are drawn, as the shader finds it. */
function drawnBy(mesh: InstanceMesh): number[][] {
  if (!mesh.visible) return [];
  return Array.from({ length: mesh.count }, (_, i) => {
    const matrix = new Matrix4();
    mesh.getMatrixAt(i, matrix);
    return new Vector3().setFromMatrixPosition(matrix.premultiply(mesh.matrixWorld)).toArray();
  });
}

const places = (meshes: InstanceMesh[]) => meshes.map(drawnBy);

describe("instances", () => {
  it("cast into a volume, in view or not, until they are looked at again", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    instances.stand(1, at(0, -10));
    instances.stand(2, at(0, 10));
    instances.look(viewTo());
    expect(instances.castInto(viewTo(Math.PI))).toEqual(meshes());
    expect(places(meshes())).toEqual([[[0, 0, 10]]]);
    expect(instances.castInto(viewTo(Math.PI / 2))).toEqual([]);
    instances.look(viewTo());
    expect(places(meshes())).toEqual([[[0, 0, -10]]]);
  });

  it("have room for all, so that nothing is made anew when one turns round", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    instances.stand(1, at(0, -10));
    for (let object = 2; object < 20; object += 1) instances.stand(object, at(0, 10));
    instances.look(viewTo());
    const before = meshes()[0]?.instanceMatrix;
    instances.look(viewTo(Math.PI));
    expect(drawnBy(meshes()[0] as InstanceMesh).length).toBe(18);
    expect(meshes()[0]?.instanceMatrix).toBe(before);
  });

  it("are given to the graphics card once before they come into view, without being drawn", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    const given = () => meshes().map(({ visible, count }) => [visible, count]);
    instances.stand(1, at(0, 10));
    instances.look(viewTo());
    expect(given()).toEqual([[false, 0]]);
    expect([instances.introduce(), given()]).toEqual([true, [[true, 0]]]);
    const before = meshes()[0]?.instanceMatrix;
    instances.look(viewTo());
    expect([instances.introduce(), given()]).toEqual([false, [[false, 0]]]);
    instances.look(viewTo(Math.PI));
    expect(given()).toEqual([[true, 1]]);
    expect(meshes()[0]?.instanceMatrix).toBe(before);
  });

  it("are drawn where they stand by one mesh for each part, and only those in view", () => {
    const { parts, root, meshes } = model(at(0, 0), at(2, 0));
    const instances = new Instances(parts, false, root);
    instances.stand(1, at(0, -10));
    instances.stand(2, at(0, 10));
    instances.stand(3, at(1, -20));
    instances.look(viewTo());
    expect(places(meshes())).toEqual([
      [
        [0, 0, -10],
        [1, 0, -20],
      ],
      [
        [2, 0, -10],
        [3, 0, -20],
      ],
    ]);
    instances.look(viewTo(Math.PI));
    expect(places(meshes())).toEqual([[[0, 0, 10]], [[2, 0, 10]]]);
    instances.look(viewTo(Math.PI / 2));
    expect(places(meshes())).toEqual([[], []]);
  });

  it("move, leave and come back", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    for (const object of [1, 2, 3]) instances.stand(object, at(0, -10 * object));
    instances.look(viewTo());
    instances.stand(2, at(1, -20));
    instances.look(viewTo());
    expect(places(meshes())).toEqual([
      [
        [0, 0, -10],
        [1, 0, -20],
        [0, 0, -30],
      ],
    ]);
    instances.remove(1);
    instances.look(viewTo());
    expect(places(meshes())).toEqual([
      [
        [0, 0, -30],
        [1, 0, -20],
      ],
    ]);
    instances.remove(1);
    for (const object of [2, 3]) instances.remove(object);
    instances.look(viewTo());
    expect(places(meshes())).toEqual([[]]);
    instances.stand(1, at(0, -40));
    instances.look(viewTo());
    expect(places(meshes())).toEqual([[[0, 0, -40]]]);
  });

  it("are told to the graphics card only where they are others than before", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    for (const object of [1, 2]) instances.stand(object, at(0, object === 1 ? -10 : 10));
    const versions = [viewTo(), viewTo(), viewTo(0.1), viewTo(Math.PI)].map((view) => {
      instances.look(view);
      return meshes()[0]?.instanceMatrix.version;
    });
    expect(versions).toEqual([1, 1, 1, 2]);
  });

  it("get room for as many as come, and what had less room is freed", () => {
    const { parts, root, meshes } = model(at(0, 0), at(0, 0), at(1, 0));
    const instances = new Instances(parts, false, root);
    const freed: string[] = [];
    meshes().forEach((mesh, i) => {
      mesh.addEventListener("dispose", () => freed.push(`${i}: ${mesh.instanceMatrix.count}`));
    });
    for (let object = 0; object < 5; object += 1) {
      instances.stand(object, at(object, -30));
      instances.look(viewTo());
    }
    expect(freed).toEqual(["0: 0", "1: 0", "2: 0", "0: 2", "1: 2", "2: 2"]);
    expect(places(meshes()).map(({ length }) => length)).toEqual([5, 5, 5]);
    const [first, second, third] = meshes();
    // Parts at the same place share their matrices.
    expect([first?.instanceMatrix === second?.instanceMatrix, first?.instanceMatrix === third?.instanceMatrix]).toEqual(
      [true, false],
    );
  });

  it("that are mirrored turn their mesh inside out instead, unless a part does so once more", () => {
    const mirror = new Matrix4().makeScale(1, 1, -1);
    const { parts, root, meshes } = model(at(1, 2), mirror);
    const instances = new Instances(parts, true, root);
    instances.stand(1, at(3, -10).multiply(mirror));
    instances.look(viewTo());
    expect(places(meshes())).toEqual([[[4, 0, -12]], [[3, 0, -10]]]);
    const facing = meshes().map((mesh) => {
      const matrix = new Matrix4();
      mesh.getMatrixAt(0, matrix);
      return [Math.sign(mesh.matrixWorld.determinant()), Math.sign(matrix.determinant())];
    });
    expect(facing).toEqual([
      [-1, 1],
      [1, 1],
    ]);
  });

  it("are told from a place near the eye, so that few digits suffice far from the world's origin", () => {
    const { parts, root, meshes } = model(at(0, 0), new Matrix4().makeScale(-1, 1, 1));
    const instances = new Instances(parts, false, root);
    instances.stand(1, at(100_000.001, -10));
    for (const x of [100_000, 100_050, 99_990]) {
      instances.look(viewTo(Math.atan((x - 100_000) / 10), x));
      for (const [place] of places(meshes())) {
        expect(place?.[0]).toBeCloseTo(100_000.001, 5);
        expect(place?.[2]).toBe(-10);
      }
    }
  });

  it("tell the nearest in view, by which near meshes are drawn first", () => {
    const { parts, root, meshes } = model(at(0, 0));
    const instances = new Instances(parts, false, root);
    for (const z of [5, -20, -7, -9]) instances.stand(z, at(0, z));
    instances.look(viewTo());
    expect(meshes()[0]?.boundingSphere?.center.z).toBe(-7);
  });

  it("are met by rays, in view or not, and say which they are after others have left", () => {
    const { parts, root, meshes } = model(at(1, 0), new Matrix4().makeScale(-1, 1, 1).setPosition(-1, 0, 0));
    const instances = new Instances(parts, false, root);
    for (const object of [5, 6, 7]) instances.stand(object, at(0, 10 * (object - 5) + 10));
    instances.look(viewTo());
    const met = (x: number) => {
      const ray = new Raycaster(new Vector3(x, 0, 0), new Vector3(0, 0, 1));
      const hits = ray.intersectObject(root, true);
      const objects = hits.map(({ object, instanceId = -1 }) => (object as InstanceMesh).objectIn(instanceId));
      return [...new Set(objects)];
    };
    expect([met(1), met(-1), met(0)]).toEqual([[5, 6, 7], [5, 6, 7], []]);
    instances.remove(5);
    expect([met(1), met(-1)]).toEqual([
      [6, 7],
      [6, 7],
    ]);
    expect(meshes().every(({ visible }) => !visible)).toBe(true);
  });
});

it("a view holds what is ahead of it within its sides, and what reaches into them", () => {
  const view = viewTo();
  expect(view.meets(0, 0, -50, 1)).toBe(true);
  expect(view.meets(0, 0, 50, 1)).toBe(false);
  expect(view.meets(0, 0, 0.5, 1)).toBe(true);
  expect(view.meets(0, 0, -102, 1)).toBe(false);
  expect([9, 12, 14].map((x) => view.meets(x, 0, -20, 1))).toEqual([true, true, false]);
  expect(viewTo(Math.PI / 2).depthOf(-3, 1, 7)).toBeCloseTo(3, 9);
});
