/**
 * What do pictures take that several things are drawn with? Each is counted once, by who uses it, and comes free with the last user.
 */

/** What each of some pictures takes, by its URL. */
export type Pictures = ReadonlyMap<string, number>;

export const NO_PICTURES: Pictures = new Map();

export class SharedPictures {
  private readonly held = new Map<string, { readonly bytes: number; users: number }>();
  private total = 0;

  /** Memory of all that are used. */
  get bytes(): number {
    return this.total;
  }

  /** What these would take more than is taken. */
  new_bytes(pictures: Pictures): number {
    let sum = 0;
    for (const [url, bytes] of pictures) if (!this.held.has(url)) sum += bytes;
    return sum;
  }

  /** One more user of each. */
  use(pictures: Pictures): void {
    for (const [url, bytes] of pictures) {
      const held = this.held.get(url);
      if (held) held.users += 1;
      else {
        this.held.set(url, { bytes, users: 1 });
        this.total += bytes;
      }
    }
  }

  /** One user less of each. */
  release(pictures: Pictures): void {
    for (const url of pictures.keys()) {
      const held = this.held.get(url);
      if (!held) continue;
      held.users -= 1;
      if (held.users > 0) continue;
      this.held.delete(url);
      this.total -= held.bytes;
    }
  }

  /** Asked about one user after the other, answers what would come free with it if those asked about before had gone. */
  ifReleased(): (pictures: Pictures) => number {
    const gone = new Map<string, number>();
    return (pictures) => {
      let freed_bytes = 0;
      for (const url of pictures.keys()) {
        const held = this.held.get(url);
        const users = (gone.get(url) ?? 0) + 1;
        gone.set(url, users);
        if (held?.users === users) freed_bytes += held.bytes;
      }
      return freed_bytes;
    };
  }
}
