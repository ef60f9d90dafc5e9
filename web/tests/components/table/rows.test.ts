import { expect, test } from 'vitest'
import { matching, paged, sorted } from '../../../src/components/table/rows'

const rows = [
  { name: 'b', size: 2 },
  { name: 'a', size: null },
  { name: 'job 10', size: 1 },
  { name: 'job 9', size: 2 },
]

test('rows without a value come last in both directions, and ties keep their order', () => {
  const names = (descending: boolean) =>
    sorted(rows, (row) => row.size, descending).map((row) => row.name)
  expect(names(false)).toEqual(['job 10', 'b', 'job 9', 'a'])
  expect(names(true)).toEqual(['b', 'job 9', 'job 10', 'a'])
})

test('numbers in names are ordered numerically', () => {
  expect(sorted(rows, (row) => row.name, false).map((row) => row.name)).toEqual([
    'a',
    'b',
    'job 9',
    'job 10',
  ])
})

test('every word must occur, ignoring case', () => {
  expect(matching(rows, 'JOB 9', (row) => row.name)).toEqual([rows[3]])
  expect(matching(rows, '  ', (row) => row.name)).toBe(rows)
})

test('a page past the end is the last page', () => {
  expect(paged([1, 2, 3, 4, 5], 7, 2)).toEqual({ rows: [5], page: 2, pages: 3 })
  expect(paged([], 0, 2)).toEqual({ rows: [], page: 0, pages: 1 })
})
