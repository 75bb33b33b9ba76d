/**
 * Where does a published tree live? Every URL inside the published documents starts with `/` and is meant relative to
 * the folder that holds `v1/` and `o/`, so that a tree also works in a sub-folder of any web server.
 */

const OBJECT = /^\/o\/[0-9a-f]+(\.[a-z0-9]+)+$/;

/** The place of a published tree. */
export class Tree {
  readonly base: URL;

  /** `base` is the folder that holds `v1/` and `o/`; a missing slash at its end is added. */
  constructor(base: string | URL) {
    const url = new URL(base);
    if (!url.pathname.endsWith("/")) url.pathname += "/";
    url.search = "";
    url.hash = "";
    this.base = url;
  }

  /** The address of a path as the documents write it: `/o/….glb`, `/v1/scenes/index.json`. */
  resolve(path: string): string {
    // Asked for again and again while one plans: nothing in the name of an object needs to be looked at twice.
    if (OBJECT.test(path)) return this.base.href + path.slice(1);
    const safe = /^\/[A-Za-z0-9._\-/]+$/.test(path) && !path.startsWith("//") && !path.split("/").includes("..");
    if (!safe) throw new Error(`"${path}" is not a path inside a published tree`);
    return new URL(path.slice(1), this.base).href;
  }

  sceneList(): string {
    return this.resolve("/v1/scenes/index.json");
  }

  pointer(scene: string): string {
    if (!isSceneName(scene)) throw new Error(`"${scene}" is not a scene name`);
    return this.resolve(`/v1/scenes/${scene}/index.json`);
  }
}

/** 1 to 64 of `a-z`, `0-9`, `-` and `_`, starting with a letter or digit; `index` is taken. */
export function isSceneName(text: string): boolean {
  return /^[a-z0-9][a-z0-9_-]{0,63}$/.test(text) && text !== "index";
}
