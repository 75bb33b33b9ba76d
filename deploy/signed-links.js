// Is a link into a private scene signed, and does it hold still? For the edge of a CDN, so that visitors with different links
// share what it keeps. Nothing but `crypto` is needed, as nginx (njs) and edge functions have it; docs/SECURITY.md says what a
// link is.
//
// The server checks every link as well: a cache that knows none of this is as safe, and keeps each link's answers apart.

import crypto from "crypto";

var LINK = /^\/s\/([a-z0-9][a-z0-9_-]{0,63})\/(0|[1-9][0-9]{0,15})\/([0-9a-f]{64})(\/.*)$/;

/** What a path opens: {scene, expires_s, below}, or null. `keyOf` gives the key of a scene (`belvedere private SCENE
 *  --show-key`), or nothing. */
function opened(path, keyOf, nowS) {
  var parts = LINK.exec(path);
  var key = parts && keyOf(parts[1]);
  if (!key || nowS >= Number(parts[2])) return null;
  var right = crypto.createHmac("sha256", key).update("/s/" + parts[1] + "/" + parts[2]).digest("hex");
  // However much of a guess is right, it takes the same time.
  var differs = 0;
  for (var i = 0; i < 64; i++) differs |= right.charCodeAt(i) ^ parts[3].charCodeAt(i);
  return differs === 0 ? { scene: parts[1], expires_s: Number(parts[2]), below: parts[4] } : null;
}

/** For nginx: what this request may share with other links to the same scene, `town|/o/….glb`; empty where no link holds.
 *  `$belvedere_link_key` is the key of the scene in `$belvedere_link_scene`. */
function shared(request) {
  var found = opened(request.variables.request_uri.split("?")[0], function (scene) {
    request.variables.belvedere_link_scene = scene;
    return request.variables.belvedere_link_key;
  }, Math.floor(Date.now() / 1000));
  return found ? found.scene + "|" + found.below : "";
}

/** For nginx: for how long this visitor may keep an object, which is as long as the link holds. */
function kept(request) {
  var parts = LINK.exec(request.variables.request_uri.split("?")[0]);
  var left = parts ? Math.max(0, Number(parts[2]) - Math.floor(Date.now() / 1000)) : 0;
  return "public, max-age=" + left + ", immutable";
}

export default { opened: opened, shared: shared, kept: kept };
