/**
 * What is where nothing is? A quiet sky above, and below it level ground as far as the haze lets one see it; both end in the same haze,
 * as does what stands far away in the world, so that no edge shows where the world ends.
 */
import { BackSide, BoxGeometry, Color, FogExp2, LinearSRGBColorSpace, Mesh, ShaderMaterial } from "three";

const HAZE = 0xd9dfe1;
const GROUND = 0xa09e90;
/** Colours above, at shares of the way from the zenith down to the horizon, in equal angles. */
const COLOURS = [
  [0, 0x3d5f8c],
  [0.76, 0x8fadc8],
  [1, HAZE],
] as const;
/** One sees so far at least, and so many times as far as a world is long: 63 % of what is there is haze. */
const [LEAST_SIGHT_M, SIGHT_LENGTHS] = [1500, 2];
/** The eye is over the ground by no less than this share of how far one sees, so that the horizon is soft for who stands, too. */
const LEAST_HEIGHT = 0.1;

const VERTEX = /* glsl */ `
varying vec3 vDirection;
varying float vAhead;
void main() {
  vDirection = position;
  vec3 inView = mat3(viewMatrix) * position;
  vAhead = -inView.z;
  // Beyond the near plane, wherever that is; and by numbers near one, since some rasterisers interpolate large ones badly.
  float near = projectionMatrix[3][2] / (projectionMatrix[2][2] - 1.0);
  gl_Position = projectionMatrix * vec4(4.0 * inView, 1.0 / near);
}`;

/** Colours are mixed as they are written in styles, not as light; so does three.js mix haze into what it draws, by the depth in the picture. */
const FRAGMENT = /* glsl */ `
uniform float shares[${COLOURS.length}];
uniform vec3 colours[${COLOURS.length}];
uniform vec3 ground;
uniform float height;
varying vec3 vDirection;
varying float vAhead;
void main() {
  vec3 direction = normalize(vDirection);
  float share = acos(clamp(direction.y, -1.0, 1.0)) / 1.57079633;
  vec3 colour = colours[0];
  for (int i = 1; i < ${COLOURS.length}; i += 1) {
    colour = mix(colour, colours[i], clamp((share - shares[i - 1]) / (shares[i] - shares[i - 1]), 0.0, 1.0));
  }
  if (direction.y < 0.0) {
    float depth = height * vAhead / -vDirection.y;
    colour = mix(colour, ground, exp(-depth * depth));
  }
  gl_FragColor = sRGBTransferEOTF(vec4(colour, 1.0));
  #include <colorspace_fragment>
}`;

export class Sky {
  /** Is drawn first, behind everything, wherever the eye is. */
  readonly mesh = backdrop();
  /** For all that is drawn before it. */
  readonly haze = new FogExp2(HAZE);
  private ground_m = 0;

  constructor() {
    this.fit(0, 0);
  }

  /** Fits it to a world: how far it reaches from corner to corner, and where its ground is. */
  fit(diagonal_m: number, ground_m: number): void {
    this.haze.density = 1 / Math.max(LEAST_SIGHT_M, SIGHT_LENGTHS * diagonal_m);
    this.ground_m = ground_m;
  }

  /** Is seen from a height. */
  seeFrom(height_m: number): void {
    const { height } = this.mesh.material.uniforms;
    if (height) height.value = Math.max(LEAST_HEIGHT, (height_m - this.ground_m) * this.haze.density);
  }
}

function backdrop(): Mesh<BoxGeometry, ShaderMaterial> {
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
      colours: { value: COLOURS.map(([, hex]) => asWritten(hex)) },
      ground: { value: asWritten(GROUND) },
      height: { value: LEAST_HEIGHT },
    },
  });
  const mesh = new Mesh(new BoxGeometry(2, 2, 2), material);
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  mesh.renderOrder = Number.NEGATIVE_INFINITY;
  return mesh;
}

function asWritten(hex: number): Color {
  return new Color().setHex(hex, LinearSRGBColorSpace);
}
