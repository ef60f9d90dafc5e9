/** Meshes of a robot's links, read by three's own loaders; loaded with the first robot that has any. */

import {
  type BufferGeometry,
  Color,
  Group,
  LoadingManager,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  SRGBColorSpace,
} from 'three'
import { ColladaLoader } from 'three/examples/jsm/loaders/ColladaLoader.js'
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js'
import { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js'
import { get } from '../../api/client'
import type { LinkMesh, ReplayHeader } from '../replay/replay'
import { disposeTree } from './dispose'

export interface LoadedMesh {
  /** Index of its link. */
  readonly link: number
  readonly object: Object3D
}

/** Where neither URDF nor file says a colour. */
const PLAIN = 0xb8bec2

type Format = 'stl' | 'obj' | 'dae'

/** Meshes that the server has of a robot, each as a new object; those that cannot be read are left out. */
export async function meshesOf(
  { urdf, links }: ReplayHeader['robot'],
  signal: AbortSignal,
): Promise<LoadedMesh[]> {
  if (urdf === null) return []
  const { items } = await get('/v1/robots/{digest}/meshes', { path: { digest: urdf }, signal })
  const known = new Map(items.map((item) => [item.name, item]))
  const texts = new Map<string, Promise<ArrayBuffer>>()
  const loaded = links.flatMap(({ meshes }, link) =>
    meshes.map(async (mesh): Promise<LoadedMesh | null> => {
      const { url = null, format = null } = known.get(mesh.name) ?? {}
      if (url === null || format === null) return null
      if (!texts.has(url)) texts.set(url, bytesOf(url, signal))
      try {
        return { link, object: placed(parsed(await texts.get(url)!, format), mesh) }
      } catch (error) {
        if (signal.aborted) throw error
        // The link keeps its simple solids.
        return null
      }
    }),
  )
  return (await Promise.all(loaded)).filter((mesh) => mesh !== null)
}

async function bytesOf(url: string, signal: AbortSignal): Promise<ArrayBuffer> {
  const answer = await fetch(url, { signal })
  if (!answer.ok) throw new Error(`${url}: ${answer.status}`)
  return answer.arrayBuffer()
}

/** What a file shows, without its textures, cameras and lights. Throws where it shows nothing. */
export function parsed(bytes: ArrayBuffer, format: Format): Object3D {
  const read = readers[format](bytes)
  const root = new Group()
  read.updateMatrixWorld(true)
  read.traverse((object) => {
    if (!(object instanceof Mesh)) return
    const geometry: BufferGeometry = object.geometry.clone().applyMatrix4(object.matrixWorld)
    // Many an STL has normals of no length.
    if (format === 'stl' || !geometry.hasAttribute('normal')) geometry.computeVertexNormals()
    const [own] = [object.material].flat() as { color?: Color }[]
    const material = new MeshStandardMaterial({ roughness: 0.55, metalness: 0.15, color: PLAIN })
    if (format === 'dae' && own?.color) material.color.copy(own.color)
    root.add(new Mesh(geometry, material))
  })
  disposeTree(read)
  if (root.children.length === 0) throw new Error('there is no mesh in it')
  return root
}

const readers: Readonly<Record<Format, (bytes: ArrayBuffer) => Object3D>> = {
  stl: (bytes) => new Mesh(new STLLoader().parse(bytes)),
  obj: (bytes) => new OBJLoader(alone()).parse(text(bytes)),
  dae: (bytes) => {
    const scene = new ColladaLoader(alone()).parse(text(bytes), '')?.scene
    if (!scene) throw new Error('it is no COLLADA file')
    // In a URDF a file's axes are as they are; the loader has turned z upwards to y.
    scene.quaternion.identity()
    return scene
  },
}

/** Asks the server for nothing more, as textures. */
function alone(): LoadingManager {
  const manager = new LoadingManager()
  manager.setURLModifier(() => 'data:,')
  return manager
}

function text(bytes: ArrayBuffer): string {
  return new TextDecoder().decode(bytes)
}

/** Where the link has it, as large and in the colour that the URDF says. */
function placed(object: Object3D, { origin, scale, colour }: LinkMesh): Object3D {
  const [x, y, z, qx, qy, qz, qw] = origin
  object.position.set(x, y, z)
  object.quaternion.set(qx, qy, qz, qw)
  object.scale.set(scale[0], scale[1], scale[2])
  object.traverse((part) => {
    if (!(part instanceof Mesh)) return
    part.castShadow = true
    part.receiveShadow = true
    if (colour === null) return
    const [red, green, blue] = colour
    part.material.color.copy(new Color().setRGB(red, green, blue, SRGBColorSpace))
  })
  return object
}
