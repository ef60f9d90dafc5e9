import { Box3, type Mesh, type MeshStandardMaterial, type Object3D } from 'three'
import { expect, test } from 'vitest'
import { parsed } from '../../../src/walk/scene/link-meshes'

const OBJ = `mtllib none.mtl
v 0 0 0
v 2 0 0
v 0 1 0
f 1 2 3
`

function boxOf(object: Object3D): Box3 {
  return new Box3().setFromObject(object)
}

function bytes(text: string): ArrayBuffer {
  return new TextEncoder().encode(text).buffer as ArrayBuffer
}

test('an OBJ is read without its materials, and gets normals', () => {
  const object = parsed(bytes(OBJ), 'obj')
  const [mesh] = object.children as Mesh[]
  expect(boxOf(object).max.toArray()).toEqual([2, 1, 0])
  expect(mesh.geometry.hasAttribute('normal')).toBe(true)
})

test('an STL is read, with or without normals', () => {
  const stl = `solid s
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 3 0 0
vertex 0 1 0
endloop
endfacet
endsolid s`
  const object = parsed(bytes(stl), 'stl')
  expect(object.children).toHaveLength(1)
  expect((object.children[0] as Mesh).material as MeshStandardMaterial).toHaveProperty(
    'isMeshStandardMaterial',
  )
  const normals = (object.children[0] as Mesh).geometry.getAttribute('normal')
  expect([normals.getX(0), normals.getY(0), normals.getZ(0)]).toEqual([0, 0, 1])
  expect(boxOf(object).max.x).toBe(3)
})

test('a file without a mesh is refused', () => {
  expect(() => parsed(bytes('# nothing'), 'obj')).toThrow('no mesh')
})
