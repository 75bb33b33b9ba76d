/**
 * How is something drawn into the shadow map? By its depth alone: where it stands, from both sides, and with the holes of its leaves. What
 * is drawn by an impostor casts the shadow of the view that is nearest to the sun's. What glows by its paint casts none: it stands for
 * panes, through which the sun comes into a hall, and for lamps.
 *
 * There is one program each for what is solid, painted, has holes, and for impostors; three.js would make others for each kind of mesh.
 */
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  GLSL3,
  Group,
  InstancedMesh,
  type IUniform,
  type Material,
  type Mesh,
  type MeshStandardMaterial,
  type Object3D,
  RawShaderMaterial,
  Texture,
} from "three";
import { AXES, ImpostorMaterial } from "./impostormaterial.ts";
import { PAINT, PAINT_AT, PaintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";

/** From how much light on something glows. */
const GLOWING = 0.15;

const HEAD = /* glsl */ `precision highp float;
precision highp int;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
in vec3 position;
in mat4 instanceMatrix;
void projectPlace(vec3 place) {
  gl_Position = projectionMatrix * modelViewMatrix * instanceMatrix * vec4(place, 1.0);
  // What stands nearer to the sun than the map reaches casts its shadow, too.
  gl_Position.z = max(gl_Position.z, -gl_Position.w);
}
`;

const SOLID_VERTEX = /* glsl */ `${HEAD}
void main() {
  projectPlace(position);
}`;

const SOLID_FRAGMENT = /* glsl */ `precision lowp float;
out vec4 nothing;
void main() {
  nothing = vec4(0.0);
}`;

const PAINTED_VERTEX = /* glsl */ `${HEAD}
in float ${PAINT};
uniform highp sampler2D palette;
void main() {
  ${PAINT_AT}
  vec3 glow = texelFetch(palette, paintAt + ivec2(1, 0), 0).rgb;
  projectPlace(position);
  if (max(glow.r, max(glow.g, glow.b)) > ${GLOWING}) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

const HOLED_VERTEX = /* glsl */ `${HEAD}
in vec2 uv;
uniform mat3 pictureFromUv;
out vec2 vAt;
void main() {
  vAt = (pictureFromUv * vec3(uv, 1.0)).xy;
  projectPlace(position);
}`;

const HOLED_FRAGMENT = /* glsl */ `precision highp float;
uniform sampler2D picture;
uniform float least;
in vec2 vAt;
out vec4 nothing;
void main() {
  if (texture(picture, vAt).a < least) discard;
  nothing = vec4(0.0);
}`;

/** The square stands behind what it shows, so that this is not in its own shadow. */
const IMPOSTOR_VERTEX = /* glsl */ `${HEAD}
in vec3 towards;
in vec4 viewA;
in vec4 viewB;
in vec4 viewC;
in vec3 viewWeights;
uniform vec3 ballCentre;
uniform float ballRadius;
out vec2 vPlace;
flat out float vView;
${AXES}
void main() {
  vec3 right = rightOf(towards);
  float most = max(viewWeights.x, max(viewWeights.y, viewWeights.z));
  vView = viewWeights.x == most ? viewA.w : viewWeights.y == most ? viewB.w : viewC.w;
  vPlace = position.xy;
  projectPlace(ballCentre + ballRadius * (position.x * right + position.y * cross(towards, right) - 0.9 * towards));
}`;

const IMPOSTOR_FRAGMENT = /* glsl */ `precision highp float;
uniform sampler2D colourAtlas;
uniform float atlasViews;
uniform float atlasFrames;
in vec2 vPlace;
flat in float vView;
out vec4 nothing;
void main() {
  vec2 tile = vec2(mod(vView, atlasViews), floor(vView / atlasViews));
  vec2 inView = vec2(vPlace.x + 1.0, 1.0 - vPlace.y) / 2.0;
  if (textureLod(colourAtlas, (tile + inView) / vec2(atlasViews, atlasViews * atlasFrames), 0.0).a < 0.5) discard;
  nothing = vec4(0.0);
}`;

/** How materials are drawn into the shadow map. */
export class Casters {
  private readonly solid = casting(SOLID_VERTEX, SOLID_FRAGMENT);
  private readonly others = new WeakMap<Material, Material>();

  /** For a mesh that has one material or several. */
  of({ material }: Mesh): Material | Material[] {
    return Array.isArray(material) ? material.map((one) => this.for(one)) : this.for(material);
  }

  /** One of each kind that is drawn, to be prepared. */
  sample(): Object3D {
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
    const kinds = [this.solid, painted(new Palette().uniform), holed(new Texture(), 0.5), ofImpostor()];
    return new Group().add(...kinds.map((material) => new InstancedMesh(geometry, material, 0)));
  }

  dispose(): void {
    this.solid.dispose();
  }

  private for(material: Material): Material {
    return this.others.get(material) ?? this.make(material) ?? this.solid;
  }

  /** What casts for a material that is not solid; it goes with that. */
  private make(material: Material): Material | undefined {
    const made = casterOf(material);
    if (!made) return undefined;
    this.others.set(material, made);
    const forget = () => {
      material.removeEventListener("dispose", forget);
      this.others.delete(material);
      made.dispose();
    };
    material.addEventListener("dispose", forget);
    return made;
  }
}

function casterOf(material: Material): Material | undefined {
  if (material instanceof ImpostorMaterial) return ofImpostor(material.uniforms);
  if (material instanceof PaintMaterial) return painted(material.palette);
  const { map, alphaTest } = material as MeshStandardMaterial;
  // Only the first of a model's sets of coordinates is looked at.
  return map && alphaTest > 0 && map.channel === 0 ? holed(map, alphaTest) : undefined;
}

function ofImpostor(uniforms: Record<string, IUniform> = {}): Material {
  return casting(IMPOSTOR_VERTEX, IMPOSTOR_FRAGMENT, uniforms);
}

function painted(palette: IUniform): Material {
  return casting(PAINTED_VERTEX, SOLID_FRAGMENT, { palette });
}

function holed(picture: Texture, least: number): Material {
  picture.updateMatrix();
  return casting(HOLED_VERTEX, HOLED_FRAGMENT, {
    picture: { value: picture },
    pictureFromUv: { value: picture.matrix },
    least: { value: least },
  });
}

function casting(vertexShader: string, fragmentShader: string, uniforms: Record<string, IUniform> = {}): Material {
  return new RawShaderMaterial({
    name: "shadow",
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    uniforms,
    side: DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
}
