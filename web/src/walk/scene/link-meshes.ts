/** Loads meshes of a robot's links; three's loaders are imported on demand. */

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
import { disposeTree } from './renderer'

export interface LoadedMesh {
  readonly link: number
  readonly object: Object3D
}

const PLAIN = 0xb8bec2

type Format = 'stl' | 'obj' | 'dae'

/** Load the meshes that the server has for a robot; invalid ones are skipped. */
export async function meshesOf(
  { urdf, links }: ReplayHeader['robot'],
  signal: AbortSignal,
): Promise<LoadedMesh[]> {
  if (urdf === null) return []
  const { items } = await get('/v1/robots/{digest}/meshes', { path: { digest: urdf }, signal })
  const available = new Map(items.map((item) => [item.name, item]))
  const texts = new Map<string, Promise<ArrayBuffer>>()
  const loaded = links.flatMap(({ meshes }, link) =>
    meshes.map(async (mesh): Promise<LoadedMesh | null> => {
      const { url = null, format = null } = available.get(mesh.name) ?? {}
      if (url === null || format === null) return null
      if (!texts.has(url)) texts.set(url, bytesOf(url, signal))
      try {
        return { link, object: placed(parsed(await texts.get(url)!, format), mesh) }
      } catch (error) {
        if (signal.aborted) throw error
        // The link keeps its simplified shape.
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

/** Parse a file, without textures, cameras and lights. Throws if there is no mesh. */
export function parsed(bytes: ArrayBuffer, format: Format): Object3D {
  const read = readers[format](bytes)
  const root = new Group()
  read.updateMatrixWorld(true)
  read.traverse((object) => {
    if (!(object instanceof Mesh)) return
    const geometry: BufferGeometry = object.geometry.clone().applyMatrix4(object.matrixWorld)
    // STL files often have zero normals.
    if (format === 'stl' || !geometry.hasAttribute('normal')) geometry.computeVertexNormals()
    const [original] = [object.material].flat() as { color?: Color }[]
    const material = new MeshStandardMaterial({ roughness: 0.55, metalness: 0.15, color: PLAIN })
    if (format === 'dae' && original?.color) material.color.copy(original.color)
    root.add(new Mesh(geometry, material))
  })
  disposeTree(read)
  if (root.children.length === 0) throw new Error('the file contains no mesh')
  return root
}

const readers: Readonly<Record<Format, (bytes: ArrayBuffer) => Object3D>> = {
  stl: (bytes) => new Mesh(new STLLoader().parse(bytes)),
  obj: (bytes) => new OBJLoader(alone()).parse(text(bytes)),
  dae: (bytes) => {
    const scene = new ColladaLoader(alone()).parse(text(bytes), '')?.scene
    if (!scene) throw new Error('not a COLLADA file')
    // URDF uses the file's axes as they are; the loader has converted z-up to y-up.
    scene.quaternion.identity()
    return scene
  },
}

/** A manager that loads no further files, such as textures. */
function alone(): LoadingManager {
  const manager = new LoadingManager()
  manager.setURLModifier(() => 'data:,')
  return manager
}

function text(bytes: ArrayBuffer): string {
  return new TextDecoder().decode(bytes)
}

function placed(object: Object3D, { origin, scale, colour }: LinkMesh): Object3D {
  object.position.fromArray(origin)
  object.quaternion.fromArray(origin, 3)
  object.scale.fromArray(scale)
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
