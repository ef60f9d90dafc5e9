/** Table of designs with links to their simulations. */

import type { Job } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { formatValue, named } from '../../format/value'
import { inWords } from '../../format/words'
import { PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { DesignLink } from '../columns'
import { caseWords } from '../facts'
import { columnNamed, type ParticleColumn, type Particles } from './particles'

const DIGITS: Readonly<Record<string, number>> = { integer: 1, continuous: 4 }

interface SelectedDesignsProps {
  job: Job
  particles: Particles
  rows: readonly number[]
  marked?: number | null
}

export function SelectedDesigns({ job, particles, rows, marked = null }: SelectedDesignsProps) {
  const iteration = columnNamed(particles, 'iteration')!.values
  const particle = columnNamed(particles, 'particle')!.values
  const numbers = particles.columns.filter(({ kind }) => kind !== 'index')
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <Table
      caption="Designs"
      rows={rows}
      rowKey={(row) => `${iteration[row]} ${particle[row]}`}
      paging={paging}
      order={{ column: 'fitness', descending: false }}
      rowData={(row) => ({ 'data-marked': String(row === marked) })}
      columns={[
        {
          key: 'design',
          header: true,
          value: (row) => iteration[row] * 1e5 + particle[row],
          cell: (row) => (
            <DesignLink job={job} iteration={iteration[row]} particle={particle[row]} />
          ),
        },
        ...numbers.map(
          (column): Column<number> => ({
            key: column.name,
            label: labelOf(column, job),
            unit: column.unit,
            numeric: column.kind !== 'categorical',
            value: (row) => (Number.isNaN(column.values[row]) ? null : column.values[row]),
            cell: (row) =>
              formatValue(named(column.values[row], column.choices), DIGITS[column.kind] ?? 5),
          }),
        ),
      ]}
    />
  )
}

function labelOf({ name, kind }: ParticleColumn, job: Job): string {
  if (kind === 'utility') return name.replace(/^utility:/, `${caseWords(job.kind).measure} `)
  return kind === 'objective' ? inWords(name.replace(/^objective:/, '')) : name
}
