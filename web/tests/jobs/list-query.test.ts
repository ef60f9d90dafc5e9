import { describe, expect, test } from 'vitest'
import { descends, isFiltered, listQuery, reordered } from '../../src/jobs/list-query'

const read = (text: string) => listQuery(new URLSearchParams(text))

describe('the list of jobs', () => {
  test('shows the newest that are not archived unless its address says otherwise', () => {
    expect(read('')).toEqual({ archived: false, order: 'created', reverse: false })
    expect(isFiltered(read(''))).toBe(false)
    expect(isFiltered(read('archived&order=name'))).toBe(false)
  })

  test('takes from its address what the server finds and sorts by', () => {
    const asked = read('search=gait&state=failed&controller=pi&tag=a&archived&order=fitness')
    expect(asked).toMatchObject({ search: 'gait', state: 'failed', controller: 'pi', tag: 'a' })
    expect(asked).toMatchObject({ archived: true, order: 'fitness' })
    expect(isFiltered(asked)).toBe(true)
  })

  test('leaves out what cannot be', () => {
    expect(read('state=lost&order=age&search=')).toEqual({
      archived: false,
      order: 'created',
      reverse: false,
    })
  })

  test('turns round what is sorted by already, begins with any other as it is, and on the first page', () => {
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
