import { describe, expect, test } from 'vitest'
import { descends, isFiltered, listQuery, reordered } from '../../src/jobs/list-query'

const read = (text: string) => listQuery(new URLSearchParams(text))

describe('the list of jobs', () => {
  test('shows the newest jobs that are not archived by default', () => {
    expect(read('')).toEqual({ archived: false, order: 'created', reverse: false })
    expect(isFiltered(read(''))).toBe(false)
    expect(isFiltered(read('archived&order=name'))).toBe(false)
  })

  test('takes filters and order from the address', () => {
    const query = read('search=gait&state=failed&controller=pi&tag=a&archived&order=fitness')
    expect(query).toMatchObject({ search: 'gait', state: 'failed', controller: 'pi', tag: 'a' })
    expect(query).toMatchObject({ archived: true, order: 'fitness' })
    expect(isFiltered(query)).toBe(true)
  })

  test('ignores invalid values', () => {
    expect(read('state=lost&order=age&search=')).toEqual({
      archived: false,
      order: 'created',
      reverse: false,
    })
  })

  test('reverses the current order, and starts any other on the first page', () => {
    expect(reordered(read('order=gain'), 'gain')).toEqual({
      order: 'gain',
      reverse: '',
      after: null,
    })
    expect(reordered(read('order=gain&reverse'), 'gain')).toEqual({
      order: 'gain',
      reverse: null,
      after: null,
    })
    expect(reordered(read('order=gain&reverse'), 'name')).toEqual({
      order: 'name',
      reverse: null,
      after: null,
    })
    expect([descends('gain', false), descends('gain', true)]).toEqual([true, false])
    expect([descends('created', false), descends('fitness', true)]).toEqual([false, true])
  })
})
