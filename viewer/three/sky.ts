/** What is where nothing is? A quiet gradient, from haze at the horizon to a deep zenith, and darker ground below. */
import { BackSide, BoxGeometry, Color, LinearSRGBColorSpace, Mesh, ShaderMaterial } from "three";

/** Colours at shares of the way from the zenith down, in equal angles. */
const COLOURS = [
  [0, 0x3d5f8c],
  [0.38, 0x8fadc8],
  [0.5, 0xd9dfe1],
  [0.54, 0x8c8a86],
  [1, 0x3b3a3a],
] as const;

const VERTEX = /* glsl */ `
varying vec3 vDirection;
void main() {
  vDirection = position;
  // Beyond the near plane, wherever that is; and by numbers near one, since some rasterisers interpolate large ones badly.
  float near = projectionMatrix[3][2] / (projectionMatrix[2][2] - 1.0);
  gl_Position = projectionMatrix * vec4(mat3(viewMatrix) * (4.0 * position), 1.0 / near);
}`;

/** Colours are mixed as they are written in styles, not as light. */
const FRAGMENT = /* glsl */ `
uniform float shares[${COLOURS.length}];
uniform vec3 colours[${COLOURS.length}];
varying vec3 vDirection;
void main() {
  float share = 0.5 - asin(clamp(normalize(vDirection).y, -1.0, 1.0)) / 3.14159265;
  vec3 colour = colours[0];
  for (int i = 1; i < ${COLOURS.length}; i += 1) {
    colour = mix(colour, colours[i], clamp((share - shares[i - 1]) / (shares[i] - shares[i - 1]), 0.0, 1.0));
  }
  gl_FragColor = sRGBTransferEOTF(vec4(colour, 1.0));
  #include <colorspace_fragment>
}`;

/** Is drawn first, behind everything, wherever the eye is. */
export function sky(): Mesh {
  const material = new ShaderMaterial({
    name: "sky",
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: BackSide,
    depthTest: false,
    depthWrite: false,
    toneMapped: false,
    uniforms: {
      shares: { value: COLOURS.map(([share]) => share) },
      colours: { value: COLOURS.map(([, hex]) => new Color().setHex(hex, LinearSRGBColorSpace)) },
    },
  });
  const mesh = new Mesh(new BoxGeometry(2, 2, 2), material);
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  mesh.renderOrder = Number.NEGATIVE_INFINITY;
  return mesh;
}
