/** How does a GLB become meshes? three.js decodes it; pictures come from a cache, never from the network. */
import { type Mesh, type Object3D, PointsMaterial, type Texture } from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { TextureCache } from "./textures.ts";

/** What a GLB says of its textures. */
interface TextureTable {
  readonly textures: readonly { readonly extensions?: Readonly<Record<string, unknown>> }[];
}

const POINT_SIZE_PX = 2;

export class GlbLoader {
  private readonly loader: GLTFLoader;

  constructor(textures: TextureCache) {
    this.loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
    const textureLoader = textures.loader();
    this.loader.register((parser) => {
      parser.textureLoader = textureLoader;
      return { name: "BELVEDERE_cached_textures" };
    });
    // GPU-compressed pictures would need a transcoder of half a megabyte; such a model is drawn without them.
    this.loader.register((parser) => ({
      name: "KHR_texture_basisu",
      loadTexture: (index) => {
        const texture = (parser.json as TextureTable).textures[index];
        return texture?.extensions?.KHR_texture_basisu ? Promise.resolve(null as unknown as Texture) : null;
      },
    }));
  }

  async parse(glb: ArrayBuffer): Promise<GLTF> {
    const gltf = await this.loader.parseAsync(glb, "");
    gltf.scene.traverse(prepare);
    return gltf;
  }
}

/** The published textures that a GLB refers to, as their URLs in the tree. */
export function textureUrls(glb: ArrayBuffer): string[] {
  const view = new DataView(glb);
  if (view.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67) throw new Error("not a GLB");
  const length = view.getUint32(12, true);
  if (length > view.byteLength - 20) throw new Error("a GLB ends before its JSON does");
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length))) as {
    images?: { uri?: unknown }[];
  };
  const names = (json.images ?? []).map(({ uri }) => (typeof uri === "string" ? uri : ""));
  const published = names.map((name) => name.slice(name.lastIndexOf("/") + 1));
  return [
    ...new Set(published.filter((name) => /^[0-9a-f]{64}\.[a-z0-9]{1,8}$/.test(name)).map((name) => `/o/${name}`)),
  ];
}

function prepare(node: Object3D): void {
  const { material } = node as Partial<Mesh>;
  for (const one of material ? [material].flat() : []) {
    if (one instanceof PointsMaterial) one.size = POINT_SIZE_PX * globalThis.devicePixelRatio;
  }
}
