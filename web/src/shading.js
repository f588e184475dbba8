// The head is lit by the text of GLSL that draws the project's own pictures: same light, same tone.
import * as THREE from "three";

const VERTEX = `
#include <skinning_pars_vertex>
attribute float _occlusion;
uniform mat4 key_view; uniform vec3 middle; uniform bool rounded;
varying vec3 place; centroid varying vec3 smooth_normal; varying vec2 at; centroid varying vec4 paint;
varying vec3 from_key;
#ifdef STRANDS
attribute vec3 _strand;
centroid varying vec3 along;
#endif
#ifdef FOLDS
attribute vec4 _folds_0; attribute vec4 _folds_1; attribute vec4 _folds_2; attribute vec4 _folds_3;
uniform vec4 fold_strengths[4];
centroid varying vec2 crease;
#endif
uniform vec4 opening[3]; uniform bool inside;
varying float open;
OPENNESS
void main() {
    #include <beginnormal_vertex>
    #include <skinbase_vertex>
    #include <skinnormal_vertex>
    #include <begin_vertex>
    open = inside ? openness(opening, transformed) : 1.0;
    #include <skinning_vertex>
    vec4 world = modelMatrix * vec4(transformed, 1.0);
    place = world.xyz;
    smooth_normal = normalize(mat3(modelMatrix) * objectNormal);
    if (rounded) {
        vec3 away = normalize(place - middle);
        if (dot(smooth_normal, away) < 0.0) smooth_normal = -smooth_normal;
        smooth_normal = normalize(0.4 * smooth_normal + 0.6 * away);
    }
    at = vec2(uv.x, 1.0 - uv.y);
    #ifdef FOLDS
    crease = vec2(dot(_folds_0, fold_strengths[0]) + dot(_folds_1, fold_strengths[1]),
        dot(_folds_2, fold_strengths[2]) + dot(_folds_3, fold_strengths[3]));
    #endif
    // Colours in a .glb hold the occlusion; here it is a light's affair.
    paint = vec4(1.0, 1.0, 1.0, _occlusion);
    #if defined(USE_COLOR_ALPHA) || defined(USE_COLOR)
    paint.rgb = color.rgb / max(_occlusion, 0.05);
    #endif
    from_key = (key_view * world).xyz;
    #ifdef STRANDS
    along = _strand;
    #endif
    gl_Position = VIEW;
}`;

const FRAGMENT = `
uniform Finish finish; uniform vec3 tint; uniform float rough_factor; uniform bool turns;
uniform float metal; uniform float gain; uniform bool fades; uniform bool painted_as; uniform vec3 shade;
uniform float core; uniform float fringe_gain; uniform bool fringe; uniform float shadow_bias;
uniform float exposure; uniform float normal_scale; uniform bool relief; uniform bool shadowed;
uniform sampler2D color_map; uniform sampler2D normal_map; uniform sampler2D roughness_map;
uniform sampler2D shadow_map;
varying vec3 place; centroid varying vec3 smooth_normal; varying vec2 at; centroid varying vec4 paint;
varying vec3 from_key;
varying float open;
uniform vec3 eye;
#ifdef STRANDS
centroid varying vec3 along;
#endif
vec2 texel_at() { return vec2(at.x, 1.0 - at.y); }
#ifdef FOLDS
uniform sampler2D folds_map; uniform float fold_lines; uniform float fold_step;
centroid varying vec2 crease;
float height(vec2 off) {
    vec3 fold = texture2D(folds_map, texel_at() + off).rgb * 2.0 - 1.0;
    return dot(fold, vec3(crease, crease.x * fold_lines));
}
#endif
void main() {
    vec3 view = normalize(cameraPosition - place);
    vec2 spot = texel_at();
    #ifndef CARDS
    if (eye.z > 0.0) {
        spot = refracted(at, eye, view, place, normalize(smooth_normal));
        spot.y = 1.0 - spot.y;
    }
    #endif
    vec4 texel = texture2D(color_map, spot);
    bool gone = false;
    #ifdef CARDS
    texel.a *= gain * (fades ? edge_on(place, view) : 1.0);
    gone = fringe ? texel.a >= core || texel.a < 0.01 : texel.a < core;
    #endif
    Point p;
    // Between the samples of an edge, values run past those of their corners.
    p.albedo = max(paint.rgb, 0.0) * texel.rgb * tint;
    p.view = view;
    p.blunt = normalize(smooth_normal) * (turns && !gl_FrontFacing ? -1.0 : 1.0);
    p.normal = p.blunt;
    p.strand = vec3(0.0);
    #ifdef STRANDS
    p.strand = along * inversesqrt(max(dot(along, along), 1e-20));
    #endif
    vec3 rough = vec3(1.0);
    #ifdef MAPPED
    rough = texture2D(roughness_map, texel_at()).rgb;
    #endif
    p.metal = metal * rough.b;
    p.occlusion = min(clamp(paint.a, 0.0, 1.0), rough.r);
    p.roughness = clamp(rough_factor * rough.g, 0.05, 1.0);
    enclosed(p, open);
    #ifdef MAPPED
    vec3 turned = relief ? texture2D(normal_map, texel_at()).xyz : vec3(0.5, 0.5, 1.0);
    #ifdef FOLDS
    turned = folded(p, turned,
        vec3(height(vec2(0.0)), height(vec2(fold_step, 0.0)), height(vec2(0.0, -fold_step))));
    #endif
    if (relief) p.normal = bumped(turned, normal_scale, place, at, p.blunt);
    #endif
    // What looks at neighbouring pixels stands above; most of a card is not lit at all.
    if (gone) {
        discard;
    } else {
        p.shadow = 1.0;
        if (shadowed)
            p.shadow = open_to_key(textureLod(shadow_map, from_key.xy * 0.5 + 0.5, 0.0).xy,
                from_key.z - shadow_bias);
        float alpha = fringe ? min(texel.a * fringe_gain, 1.0) : 1.0;
        gl_FragColor = vec4((painted_as ? painted(p, shade) : shown(lit(p, finish), exposure)) * alpha, alpha);
    }
}`;

const DEPTHS = `
uniform sampler2D color_map; uniform float gain;
varying vec2 at; varying vec3 from_key;
void main() {
    #ifdef CARDS
    if (texture2D(color_map, vec2(at.x, 1.0 - at.y)).a * gain < 0.5) discard;
    #endif
    gl_FragColor = vec4(from_key.z, from_key.z * from_key.z, 0.0, 1.0);
}`;

const EYE = "projectionMatrix * viewMatrix * world", KEY = "key_view * world";

export class Shading {
  // stage: as export/html.py writes it.
  constructor(stage) {
    this.stage = stage;
    this.blank = new THREE.DataTexture(new Uint8Array([255, 255, 255, 255]), 1, 1);
    this.blank.needsUpdate = true;
    this.shared = {
      key_view: { value: new THREE.Matrix4().fromArray(stage.key_view) },
      exposure: { value: stage.exposure },
      shadow_map: { value: null },
      shadowed: { value: false },
      shadow_bias: { value: stage.shadow_bias },
    };
  }

  // Draw a mesh our way, with the pictures of its material in the file. Few programs do, as each
  // takes long to build: what differs between materials is told by uniforms where that can be.
  // `folded`: the part that folds, if one does; `mouth`: the opening of the lips.
  dress(mesh, pictures, folded, mouth) {
    const { record } = mesh.userData;
    const folds = folded?.mesh === mesh ? folded : null;
    const fringe = record.alphaMode === "BLEND";
    const part = this.stage.parts[record.name.replace(/_fringe$/, "")];
    const { baseColorTexture: color, metallicRoughnessTexture: rough } = record.pbrMetallicRoughness;
    const cards = part.core > 0;
    const shape = cards ? { CARDS: "" } : {};
    const mapped = !cards || rough || record.normalTexture;
    const uniforms = {
      ...this.shared,
      finish: { value: part.finish },
      tint: { value: new THREE.Vector3(...part.tint) },
      rough_factor: { value: part.rough },
      turns: { value: part.turns },
      metal: { value: part.metal },
      gain: { value: part.alpha },
      fades: { value: part.fades },
      painted_as: { value: Boolean(part.shade) },
      shade: { value: new THREE.Vector3(...(part.shade ?? [1, 1, 1])) },
      core: { value: part.core },
      fringe: { value: fringe },
      fringe_gain: { value: part.fringe_gain },
      rounded: { value: part.rounded },
      middle: { value: middleOf(mesh) },
      relief: { value: Boolean(record.normalTexture) },
      normal_scale: { value: part.normal_scale },
      eye: { value: part.eye },
      inside: { value: part.inside },
      ...mouth.uniforms,
      color_map: { value: color ? pictures[color.index] : this.blank },
      normal_map: { value: record.normalTexture ? pictures[record.normalTexture.index] : this.blank },
      roughness_map: { value: rough ? pictures[rough.index] : this.blank },
      ...folds?.uniforms,
    };
    const program = (vertex, fragment, more) => new THREE.ShaderMaterial({
      uniforms, vertexColors: true,
      vertexShader: VERTEX.replace("VIEW", vertex).replace("OPENNESS", this.stage.openness_glsl),
      fragmentShader: fragment, ...more,
    });
    mesh.material = program(EYE, this.stage.glsl + FRAGMENT, {
      side: part.both_sides ? THREE.DoubleSide : THREE.FrontSide,
      defines: {
        ...shape, ...(mapped && { MAPPED: "" }), ...(folds && { FOLDS: "" }),
        ...(mesh.geometry.hasAttribute("_strand") && { STRANDS: "" }),
      },
      ...(fringe && {
        transparent: true, depthWrite: false, blending: THREE.CustomBlending,
        blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor,
      }),
    });
    // What is sheer lies close on the skin, under the fringes of hair.
    mesh.renderOrder = part.core > 1 ? -1 : 0;
    const casts = part.casts && !fringe;
    mesh.userData.depths = casts && program(KEY, DEPTHS, { side: THREE.DoubleSide, defines: shape });
  }
}

function middleOf(mesh) {
  mesh.geometry.computeBoundingBox();
  return mesh.geometry.boundingBox.getCenter(new THREE.Vector3());
}

// What the key sees: depths and their squares, blurred, so that a share of it is a soft shadow.
export class Shadow {
  static possible(renderer) {
    return ["EXT_color_buffer_float", "OES_texture_float_linear"].every((name) =>
      renderer.extensions.has(name));
  }

  constructor(shading, side) {
    const target = (size, depthBuffer) => new THREE.WebGLRenderTarget(size, size, {
      format: THREE.RGFormat, type: THREE.FloatType, depthBuffer,
      minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter,
    });
    this.raw = target(2 * side, true);
    this.between = target(side, false);
    this.moments = target(side, false);
    this.eye = new THREE.Camera();
    this.across = this.blur(shading.stage.taps, side, this.raw, "vec2(o, 0.0)");
    this.down = this.blur(shading.stage.taps, side, this.between, "vec2(0.0, o)");
    shading.shared.shadow_map.value = this.moments.texture;
    shading.shared.shadowed.value = true;
  }

  blur(taps, side, source, step) {
    const sum = taps.map(([offset, weight]) =>
      `texture2D(drawn, spot + ${step.replace("o", (offset / side).toFixed(9))}) * ${weight.toFixed(9)}`);
    const scene = new THREE.Scene();
    scene.add(new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShaderMaterial({
      uniforms: { drawn: { value: source.texture } }, depthTest: false, depthWrite: false,
      vertexShader: "varying vec2 spot; void main() { spot = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }",
      fragmentShader: `uniform sampler2D drawn; varying vec2 spot; void main() { gl_FragColor = ${sum.join(" + ")}; }`,
    })));
    return scene;
  }

  draw(renderer, scene, meshes) {
    const ours = meshes.map((mesh) => mesh.material);
    meshes.forEach((mesh) => {
      if (mesh.userData.depths) mesh.material = mesh.userData.depths;
      else mesh.visible = false;
    });
    renderer.setClearColor(0xffffff, 1);
    renderer.setRenderTarget(this.raw);
    renderer.render(scene, this.eye);
    meshes.forEach((mesh, index) => { mesh.material = ours[index]; mesh.visible = true; });
    renderer.setRenderTarget(this.between);
    renderer.render(this.across, this.eye);
    renderer.setRenderTarget(this.moments);
    renderer.render(this.down, this.eye);
    renderer.setRenderTarget(null);
    renderer.setClearColor(0x000000, 0);
  }
}
