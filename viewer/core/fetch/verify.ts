/**
 * Are these the bytes that their URL names? Every immutable object is called by its SHA-256, so a client can catch a
 * damaged disk, a broken proxy or a lying mirror. WebCrypto exists in secure contexts only (https and localhost).
 */
export type Verdict = "verified" | "mismatch" | "unverified" | "later";

/** Whether bytes may be what a URL promises: they are not known to be anything else. */
export type IsSound = (url: string, bytes: ArrayBuffer) => Promise<boolean>;

/** The part of WebCrypto that is needed. */
export type Digest = (bytes: ArrayBuffer) => Promise<ArrayBuffer>;

/** The digest of this environment, when it has one. */
export function webCryptoDigest(): Digest | undefined {
  const subtle = globalThis.crypto?.subtle;
  return subtle && ((bytes) => subtle.digest("SHA-256", bytes));
}

/** The hash that a URL of an immutable object promises. */
export function promisedHash(url: string): string | undefined {
  return /\/o\/([0-9a-f]{64})\.[a-z0-9]{1,8}$/.exec(url)?.[1];
}

/** Whether a URL is that of an object, which never changes. */
export function isImmutable(url: string): boolean {
  return /\/o\/[0-9a-f]{64}\./.test(url);
}

/** Whether a URL names a slice, so that only all slices together can be compared with its hash. */
export function isRung(url: string): boolean {
  return /\/o\/[0-9a-f]{64}\.r[0-9]{1,3}\.slod$/.test(url);
}

/** What a rung is a slice of. */
export function streamOf(url: string): string | undefined {
  // Asked of every file while one plans, most of which are no streams.
  return url.endsWith(".slod") && isRung(url) ? url.replace(/\.r[0-9]+\.slod$/, ".slod") : undefined;
}

/**
 * Compares bytes with the hash in their URL. URLs without a hash, and bytes without a digest, stay unverified; rungs are
 * verified later, when the last of them has come.
 */
export async function verify(url: string, bytes: ArrayBuffer, digest: Digest | undefined): Promise<Verdict> {
  const promised = promisedHash(url);
  if (digest && isRung(url)) return "later";
  if (!promised || !digest) return "unverified";
  const actual = [...new Uint8Array(await digest(bytes))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  return actual === promised ? "verified" : "mismatch";
}
