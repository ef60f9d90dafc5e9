import { describe, expect, test } from 'vitest'
import { ApiProblem } from '../../src/api/problem'
import { changeAll } from '../../src/jobs/deletion'

describe('changing several jobs', () => {
  test('continues after a refusal, and gives its reason without commands', async () => {
    const requested: string[] = []
    const { changed, refused } = await changeAll(['a', 'b', 'c', 'd', 'e'], async (id) => {
      requested.push(id)
      if (id === 'b') throw new ApiProblem(409, 'cancel it first: `gaitswarm cancel b`, or POST')
    })
    expect(requested).toEqual(['a', 'b', 'c', 'd', 'e'])
    expect(changed).toEqual(['a', 'c', 'd', 'e'])
    expect(refused).toEqual([{ id: 'b', reason: 'cancel it first' }])
  })

  test('stops if the server is unreachable', async () => {
    const away = () => Promise.reject(new ApiProblem(0, 'the server cannot be reached'))
    await expect(changeAll(['a'], away)).rejects.toThrow('cannot be reached')
  })
})
