/** Which file does a path of an `import` name? One in the folder of the first file or below it, and no other. */
import { numberOf } from "./error.ts";

const BESIDE = "put the file beside the source";

/** The path without `.` parts. Throws an `Error` for one that leaves the folder, which a {@link Load} may throw on. */
export function insideFolder(path: string): string {
  const control = /\p{Cc}/u.exec(path)?.[0];
  if (control !== undefined) throw new Error(`a path has no ${numberOf(control)} in it: leave it out`);
  if (path.includes("://")) {
    throw new Error(`it is an address, and nothing is fetched: ${BESIDE}, and write its path`);
  }
  // It stands in drives and alternate streams, too.
  if (path.includes(":")) throw new Error(`a path has no \`:\` in it: ${BESIDE}, under a name without that`);
  if (path.includes("\\")) throw new Error("a path has no `\\` in it: write `/` behind each folder");
  if (path.startsWith("/")) {
    throw new Error(`it begins with \`/\`, at the root of a disk: ${BESIDE}, and write its path from there`);
  }
  const parts = path.split("/").filter((part) => part !== "" && part !== ".");
  if (parts.length === 0) throw new Error('it names no file: write its path, as in "tree.dcg"');
  if (parts.includes("..")) throw new Error("it lies outside of the source's folder: put it beside the source");
  return parts.join("/");
}
