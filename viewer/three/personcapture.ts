/**
 * How do pictures of a person come about? Here, from the geometry that near people are drawn with, when the first crowd
 * comes: as the bake draws an atlas (`crates/bake/src/impostors`), but by the graphics card. One draw call shows a moment from
 * all directions; another makes of it what the bake publishes, colours that are not mixed with what is behind them.
 */
import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  Camera,
  Color,
  GLSL3,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LinearFilter,
  LinearMipmapLinearFilter,
  Mesh,
  NearestFilter,
  type Object3D,
  RawShaderMaterial,
  SRGBColorSpace,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { axesOf, directionOf } from "../core/documents/impostors.ts";
import { BODY } from "./bodymaterial.ts";
import type { Drawable } from "./impostormaterial.ts";
import type { Person } from "./person.ts";
import type { Painting } from "./stage.ts";

/** Samples along a side of a pixel. */
const SAMPLES = 4;
/** How far colours reach beyond an outline, in pixels. */
const FRINGE_PX = 8;

const HEAD = /* glsl */ `precision highp float;
precision highp int;
precision highp sampler2D;
`;

const DRAW_VERTEX = /* glsl */ `${HEAD}
in vec3 right;
in vec3 towards;
in vec2 tile;
in vec3 color;
in float own;
uniform vec3 centre;
uniform float radius;
uniform float moment;
uniform float views;
out vec3 vNormal;
out float vDepth;
out vec3 vColour;
out float vOwn;
${BODY}
void main() {
  mat3 ballFromView = mat3(right, cross(towards, right), towards);
  vec3 pose = vec3(moment, moment, 0.0);
  vec3 place = ((bodyAt(bodyPositions, pose) - centre) / radius) * ballFromView;
  vNormal = bodyAt(bodyNormals, pose) * ballFromView;
  vDepth = place.z;
  vColour = color;
  vOwn = own;
  vec2 inAtlas = (tile + vec2(place.x + 1.0, 1.0 - place.y) / 2.0) / views;
  gl_Position = vec4(2.0 * inAtlas - 1.0, -place.z, 1.0);
}`;

const DRAW_FRAGMENT = /* glsl */ `${HEAD}
in vec3 vNormal;
in float vDepth;
in vec3 vColour;
in float vOwn;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 shape;
void main() {
  vec3 normal = normalize(vNormal);
  normal = normalize(vec3(normal.xy, max(normal.z, 0.05)));
  colour = vec4(sqrt(vColour), 1.0);
  shape = vec4(0.5 + 0.5 * normal.xy, 0.5 + 0.5 * vDepth, vOwn);
}`;

const FILL_VERTEX = /* glsl */ `${HEAD}
in vec3 position;
void main() {
  gl_Position = vec4(position, 1.0);
}`;

/** Colours are kept as square roots until here, which bytes hold well enough. */
const FILL_FRAGMENT = /* glsl */ `${HEAD}
uniform sampler2D drawnColour;
uniform sampler2D drawnShape;
uniform int firstRow;
uniform int viewSize;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 shape;
vec3 sumColour = vec3(0.0);
vec4 sumShape = vec4(0.0);
float count = 0.0;

void take(ivec2 at) {
  vec4 seen = texelFetch(drawnColour, at, 0);
  if (seen.a < 0.5) return;
  sumColour += seen.rgb * seen.rgb;
  sumShape += texelFetch(drawnShape, at, 0);
  count += 1.0;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) - ivec2(0, firstRow);
  for (int y = 0; y < ${SAMPLES}; y += 1) {
    for (int x = 0; x < ${SAMPLES}; x += 1) take(pixel * ${SAMPLES} + ivec2(x, y));
  }
  float coverage = count / ${SAMPLES * SAMPLES}.0;
  // What shows nothing takes over what lies beside it in the same view, or is grey.
  ivec2 least = pixel / viewSize * viewSize;
  for (int far = 1; far <= ${FRINGE_PX} && count == 0.0; far += 1) {
    for (int i = 0; i < 8; i += 1) {
      float angle = 0.785398 * float(i);
      ivec2 beside = pixel + ivec2(round(float(far) * vec2(cos(angle), sin(angle))));
      ivec2 within = clamp(beside, least, least + viewSize - 1);
      take(within * ${SAMPLES} + ${SAMPLES / 2});
    }
  }
  colour = vec4(count > 0.0 ? sumColour / count : vec3(0.2), coverage);
  shape = count > 0.0 ? sumShape / count : vec4(0.5, 0.5, 0.5, 1.0);
}`;

/** The pictures of a person, which are empty until they are drawn. */
export class PersonCapture implements Painting {
  readonly impostor: Drawable;
  /** Colour, and shape. */
  readonly pictures: readonly [Texture, Texture];
  private readonly moments: number;
  private readonly side: number;
  private readonly drawn: WebGLRenderTarget;
  private readonly atlas: WebGLRenderTarget;
  private readonly body: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  private readonly whole: Mesh<BufferGeometry, RawShaderMaterial>;

  constructor(person: Person) {
    const { views, size_px, centre, radius } = person;
    this.moments = person.frames + 1;
    this.side = views * size_px;
    const { moments, side } = this;
    const filters = { magFilter: NearestFilter, minFilter: NearestFilter };
    this.drawn = new WebGLRenderTarget(side * SAMPLES, side * SAMPLES, { count: 2, ...filters });
    this.atlas = new WebGLRenderTarget(side, side * moments, {
      count: 2,
      depthBuffer: false,
      generateMipmaps: true,
      magFilter: LinearFilter,
      minFilter: LinearMipmapLinearFilter,
    });
    this.pictures = this.atlas.textures as [Texture, Texture];
    this.pictures[0].colorSpace = SRGBColorSpace;
    this.impostor = { mapping: "hemi-octahedral", views, size_px, frames: moments, centre, radius };
    this.body = new Mesh(viewsOf(person), drawMaterial(person));
    this.whole = new Mesh(square(), fillMaterial(this.drawn.textures as [Texture, Texture], size_px));
    this.body.frustumCulled = false;
    this.whole.frustumCulled = false;
  }

  /** What is drawn for them, to be prepared. */
  sample(): Object3D {
    return new Group().add(this.body, this.whole);
  }

  /** Draws them, and frees what that took until it is drawn again. */
  draw(renderer: WebGLRenderer): void {
    const { moments, side, drawn, atlas, body, whole } = this;
    const before = { target: renderer.getRenderTarget(), colour: renderer.getClearColor(new Color()) };
    const alpha = renderer.getClearAlpha();
    renderer.setClearColor(0, 0);
    for (let moment = 0; moment < moments; moment += 1) {
      body.material.uniforms.moment = { value: moment };
      renderer.setRenderTarget(drawn);
      renderer.clear();
      renderer.render(body, new Camera());
      whole.material.uniforms.firstRow = { value: moment * side };
      atlas.viewport.set(0, moment * side, side, side);
      atlas.scissor.copy(atlas.viewport);
      atlas.scissorTest = true;
      renderer.setRenderTarget(atlas);
      renderer.render(whole, new Camera());
    }
    renderer.setRenderTarget(before.target);
    renderer.setClearColor(before.colour, alpha);
    for (const one of [body.geometry, body.material, whole.geometry, whole.material, drawn]) one.dispose();
  }
}

/** How large a pixel of its pictures is. */
export function pixelOf_m({ radius, size_px }: Person): number {
  return (2 * radius) / size_px;
}

/** The body once for each view. */
function viewsOf({ colours, own, indices, vertices, views }: Person): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  geometry.instanceCount = views * views;
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * vertices), 3));
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  geometry.setAttribute("own", new BufferAttribute(own, 1));
  geometry.setIndex(new BufferAttribute(indices, 1));
  const [towards, right, tiles]: [number[], number[], number[]] = [[], [], []];
  for (let row = 0; row < views; row += 1) {
    for (let column = 0; column < views; column += 1) {
      const axes = axesOf(directionOf("hemi-octahedral", column / (views - 1), row / (views - 1)));
      towards.push(...axes.towards);
      right.push(...axes.right);
      tiles.push(column, row);
    }
  }
  geometry.setAttribute("towards", new InstancedBufferAttribute(Float32Array.from(towards), 3));
  geometry.setAttribute("right", new InstancedBufferAttribute(Float32Array.from(right), 3));
  geometry.setAttribute("tile", new InstancedBufferAttribute(Float32Array.from(tiles), 2));
  return geometry;
}

function square(): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(Float32Array.of(-1, -1, 0, 3, -1, 0, -1, 3, 0), 3));
  return geometry;
}

function drawMaterial({ positions, normals, centre, radius, views }: Person): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: DRAW_VERTEX,
    fragmentShader: DRAW_FRAGMENT,
    // Rows of an atlas go down, which turns faces over.
    side: BackSide,
    uniforms: {
      bodyPositions: { value: positions },
      bodyNormals: { value: normals },
      centre: { value: centre },
      radius: { value: radius },
      moment: { value: 0 },
      views: { value: views },
    },
  });
}

function fillMaterial([colour, shape]: [Texture, Texture], size_px: number): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: FILL_VERTEX,
    fragmentShader: FILL_FRAGMENT,
    depthTest: false,
    depthWrite: false,
    uniforms: {
      drawnColour: { value: colour },
      drawnShape: { value: shape },
      firstRow: { value: 0 },
      viewSize: { value: size_px },
    },
  });
}
