/**
 * Which pictures are decoded? Each once, however many models use it: textures of different models share one source and
 * with it one copy on the GPU. A picture goes with the last model that uses it.
 */
import { Texture, TextureLoader, TextureSource } from "three";

interface Picture {
  readonly source: TextureSource<ImageBitmap>;
  readonly bytes: number;
  users: number;
}

/** Colour plus mip levels on the GPU, and the decoded picture that three keeps for context loss. */
const BYTES_PER_PIXEL = 4 * (4 / 3) + 4;

/** What is used from now on. */
export interface Acquired {
  /** What each picture takes, whoever else uses it. */
  readonly pictures: ReadonlyMap<string, number>;
  /** What could not be had, and why. */
  readonly failed: ReadonlyMap<string, unknown>;
}

export class TextureCache {
  private readonly pictures = new Map<string, Picture>();

  holds(url: string): boolean {
    return this.pictures.has(url);
  }

  /**
   * Counts one more user of each of these, and decodes what is not held. What is held is taken at once: while another one is decoded, its
   * last user may go.
   */
  async acquire(urls: readonly string[], encoded: ReadonlyMap<string, ArrayBuffer>): Promise<Acquired> {
    const pictures = new Map<string, number>();
    const failed = new Map<string, unknown>();
    for (const url of urls) {
      const bytes = this.share(url);
      if (bytes !== undefined) pictures.set(url, bytes);
    }
    for (const url of urls) {
      if (pictures.has(url)) continue;
      try {
        pictures.set(url, await this.decode(url, encoded.get(url)));
      } catch (error) {
        failed.set(url, error);
      }
    }
    return { pictures, failed };
  }

  /** One user less; the last one closes the picture. */
  release(url: string): void {
    const picture = this.pictures.get(url);
    if (!picture) return;
    picture.users -= 1;
    if (picture.users > 0) return;
    this.pictures.delete(url);
    picture.source.data.close();
  }

  /** Counts one more user of what is held; answers what it takes. */
  private share(url: string): number | undefined {
    const held = this.pictures.get(url);
    if (held) held.users += 1;
    return held?.bytes;
  }

  private async decode(url: string, encoded: ArrayBuffer | undefined): Promise<number> {
    if (!encoded) throw new Error(`the texture ${url} was not fetched`);
    const bitmap = await decode(new Blob([encoded]));
    const raced_bytes = this.share(url);
    if (raced_bytes !== undefined) {
      bitmap.close();
      return raced_bytes;
    }
    const bytes = Math.round(bitmap.width * bitmap.height * BYTES_PER_PIXEL);
    this.pictures.set(url, { source: new TextureSource(bitmap), bytes, users: 1 });
    return bytes;
  }

  /** What a texture of a held picture shows. */
  sourceOf(url: string): TextureSource<ImageBitmap> | undefined {
    return this.pictures.get(url)?.source;
  }

  /** A loader for GLTFLoader that answers from this cache and never from the network. */
  loader(): TextureLoader {
    return new CachedTextureLoader((name) => this.pictures.get(`/o/${name}`)?.source);
  }
}

function decode(blob: Blob): Promise<ImageBitmap> {
  return createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none", imageOrientation: "none" });
}

class CachedTextureLoader extends TextureLoader {
  constructor(private readonly sourceOf: (name: string) => TextureSource<ImageBitmap> | undefined) {
    super();
  }

  override load(
    url: string,
    onLoad?: (texture: Texture<HTMLImageElement>) => void,
    _onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): Texture<HTMLImageElement> {
    const texture = new Texture<HTMLImageElement>();
    const take = (source: TextureSource<ImageBitmap>) => {
      texture.source = source as unknown as typeof texture.source;
      texture.needsUpdate = true;
      onLoad?.(texture);
    };
    if (url.startsWith("blob:")) {
      // A picture inside the GLB; GLTFLoader has wrapped it in a URL of this page.
      fetch(url)
        .then(async (response) => take(new TextureSource(await decode(await response.blob()))))
        .catch((error: unknown) => onError?.(error));
      return texture;
    }
    const source = this.sourceOf(url.slice(url.lastIndexOf("/") + 1));
    if (source) take(source);
    else onError?.(new Error(`${url} is not among the level's textures`));
    return texture;
  }
}
