/** Are the immutable objects of a revision what their names say? Follows every URL from the manifest on. */
import { createHash } from "node:crypto";
import { gunzipSync } from "node:zlib";
import { insist } from "./tally.mjs";

const OBJECT = /\/o\/[0-9a-f]{64}\.[a-z0-9]{1,8}(?=")/g;
/** What was first sent under a tag, where the encoding cannot be decoded here: it must stay the same. */
const firstSeen = new Map();

const sha256 = (bytes) => createHash("sha256").update(bytes).digest("hex");

/** Fails unless these are, once decoded, the bytes that the URL names. */
export function check(url, { headers, body }) {
  const encoding = headers["content-encoding"] ?? "identity";
  if (encoding === "zstd") {
    const [tag, found] = [headers.etag, sha256(body)];
    insist(tag?.includes("zstd"), `${url}: zstd under the tag ${tag}`);
    if (!firstSeen.has(tag)) firstSeen.set(tag, found);
    insist(firstSeen.get(tag) === found, `${url}: other bytes under ${tag}`);
    return;
  }
  insist(["identity", "gzip"].includes(encoding), `${url}: ${encoding}`);
  const plain = encoding === "gzip" ? gunzipSync(body) : body;
  insist(url.includes(sha256(plain)), `${url}: its bytes have another hash`);
}

/** All objects of a scene's current revision, by URL, with their bytes. `link` is where its tree begins. */
export async function crawl(wire, scene, { link = "", headers = {} } = {}) {
  const pointer = await wire.json("pointer", `${link}/v1/scenes/${scene}`, { headers });
  const found = new Map();
  const ahead = [pointer.manifest];
  for (let url = ahead.pop(); url !== undefined; url = ahead.pop()) {
    if (found.has(url)) continue;
    const answer = await wire.ask("object", `${link}${url}`, { headers });
    check(url, answer);
    found.set(url, answer.body);
    if (url.endsWith(".json")) ahead.push(...(answer.body.toString().match(OBJECT) ?? []));
  }
  return { pointer, objects: found };
}
