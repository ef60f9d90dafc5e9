import { describe, expect, test } from 'vitest'
import type { JobSpec, Variable } from '../../../src/api/types'
import { hintsOf, robotName, startDesign, textOf } from '../../../src/submission/robot/job'

describe('a file of a robot', () => {
  test('is read as text', async () => {
    await expect(textOf(new File(['<robot name="ä"/>'], 'a.urdf'))).resolves.toBe(
      '<robot name="ä"/>',
    )
  })

  test.each([
    ['is not text', new Uint8Array([0x73, 0xff, 0xfe]), /a\.stl is not UTF-8 text; choose another/],
    ['is large', new Uint8Array(4_000_001), /a\.stl has 4\.0 MB.*Choose the URDF itself/],
  ])('is refused if it %s', async (_, bytes, message) => {
    await expect(textOf(new File([bytes], 'a.stl'))).rejects.toThrow(message)
  })

  test('that is missing is refused with advice', async () => {
    const missing = new File(['x'], 'a.urdf')
    missing.arrayBuffer = () => Promise.reject(new DOMException('gone', 'NotFoundError'))
    await expect(textOf(missing)).rejects.toThrow('choose it again')
  })

  test.each([
    ['a1.urdf', 'a1'],
    ['my dog (2).v1.urdf', 'my dog 2.v1'],
    ['../x/y.urdf', 'xy'],
    ['.urdf', 'robot'],
    [`${'n'.repeat(120)}.urdf`, 'n'.repeat(100)],
  ])('%s names a robot %s', (file, name) => expect(robotName(file)).toBe(name))
})

test('a preview design is the middle of the search space, with fixed values', () => {
  const variables = [
    { name: 'P', low: 0, high: 1, kind: 'continuous' },
    { name: 'N', low: 0, high: 5, kind: 'integer' },
    { name: 'feed_forward', low: 0, high: 1, kind: 'continuous' },
  ] as unknown as Variable[]
  const spec = {
    variables: [
      { name: 'P', low: 0, high: 0.5 },
      { name: 'N', low: 1, high: 4 },
      { name: 'gait', kind: 'categorical', choices: ['trot', 'pace'] },
      'feed_forward',
    ],
    fixed: { stride: 0.1 },
  } as unknown as JobSpec
  expect(startDesign(spec, variables)).toEqual({
    P: 0.25,
    N: 3,
    gait: 'trot',
    feed_forward: 0.5,
    stride: 0.1,
  })
})

describe('hints of a proposal', () => {
  test('are read as options of the command line', () =>
    expect(
      hintsOf({
        locks: '*_toe=0.5  arm=0',
        feet: 'FL_calf=0,0,-0.2',
        mass: '14.5',
        actuators: '*=mx64 a=b=xl330',
      }),
    ).toEqual({
      locks: { '*_toe': 0.5, arm: 0 },
      feet: { FL_calf: [0, 0, -0.2] },
      mass: 14.5,
      actuators: { '*': 'mx64', 'a=b': 'xl330' },
    }))

  test('are none by default', () =>
    expect(hintsOf({ locks: '', feet: ' ', mass: '', actuators: '' })).toEqual({
      locks: {},
      feet: {},
      mass: null,
      actuators: {},
    }))
})
