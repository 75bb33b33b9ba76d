/** Which file does a path of an `import` name? One in the folder of the first file or below it, and no other. */

const OUTSIDE = "it lies outside of the source's folder: put it beside the source";

/** The path without `.` parts. Throws an `Error` for one that leaves the folder, which a {@link Load} may throw on. */
export function insideFolder(path: string): string {
  // A colon stands in schemes, drives and alternate streams; none of them is a file beside the source.
  const isElsewhere = path.startsWith("/") || /[\\:]|\p{Cc}/u.test(path);
  const parts = path.split("/").filter((part) => part !== "" && part !== ".");
  if (isElsewhere || parts.length === 0 || parts.includes("..")) throw new Error(OUTSIDE);
  return parts.join("/");
}
