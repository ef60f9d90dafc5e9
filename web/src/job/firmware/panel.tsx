/** Firmware of the best design: memory use, contents and download. */

import { useState } from 'preact/hooks'
import { get, url } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Firmware, Job } from '../../api/types'
import { CopyBlock } from '../../components/copy-button'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { Table } from '../../components/table/table'
import { formatCount, formatNumber, NONE, percent, quantity } from '../../format/number'
import { inWords } from '../../format/words'

/** Index bits of a fuzzy table, for angle error and current. */
const TABLE_BITS = ['10x6', '9x6', '8x6', '8x5']
const [USUAL_BITS] = TABLE_BITS

export function FirmwarePanel({ job }: { job: Job }) {
  if (job.best_fitness === null) {
    return (
      <section class="card">
        <Empty title="No firmware yet">
          <p>Firmware is available once a design has walked in every scenario.</p>
        </Empty>
      </section>
    )
  }
  return <OfBest job={job} />
}

function OfBest({ job }: { job: Job }) {
  const [bits, setBits] = useState(USUAL_BITS)
  const query = { table_bits: bits === USUAL_BITS ? undefined : bits }
  const summary = useResource(`${job.id} ${job.best_iteration} ${bits}`, (signal) =>
    get('/v1/jobs/{job_id}/firmware/summary', { path: { job_id: job.id }, query, signal }),
  )
  const firmware = summary.data
  const hasTables = firmware === null || firmware.tables.length > 0
  return (
    <div class="stack">
      <section class="card" aria-labelledby="firmware" data-fits={firmware?.memory.fits ?? ''}>
        <header class="row spread">
          <h2 id="firmware">Firmware of the winner</h2>
          <span class="row">
            {hasTables && (
              <label class="row small">
                <span>Fuzzy table</span>
                <select value={bits} onChange={(event) => setBits(event.currentTarget.value)}>
                  {TABLE_BITS.map((choice) => (
                    <option key={choice} value={choice}>
                      {choice.replace('x', ' × ')} bits
                    </option>
                  ))}
                </select>
              </label>
            )}
            <a
              class="button primary compact"
              href={url('/v1/jobs/{job_id}/firmware', { job_id: job.id }, query)}
              download={`${job.id}-firmware.zip`}
            >
              Download
            </a>
          </span>
        </header>
        <div class="stack">
          <p class="muted small">
            C99 source for the microcontroller of one leg, without floating point, with a test that
            replays the winner’s simulations sample by sample:
          </p>
          <CopyBlock
            label="the test"
            text={`unzip ${job.id}-firmware.zip -d firmware && make -C firmware test`}
          />
          {summary.error && (
            <ErrorNotice
              what="Could not generate the firmware."
              error={summary.error}
              retry={summary.reload}
            />
          )}
          {summary.loading && !firmware && (
            <Loading what="the firmware; simulating the winner for its test" />
          )}
          {firmware && <Memory firmware={firmware} />}
        </div>
      </section>
      {firmware && <Contents firmware={firmware} />}
    </div>
  )
}

interface MemoryRow {
  readonly name: string
  readonly flash: number | null
  readonly ram: number | null
}

function Memory({ firmware: { memory, table_difference: difference } }: { firmware: Firmware }) {
  const rows: readonly MemoryRow[] = [
    { name: 'Fuzzy tables', flash: memory.tables, ram: null },
    { name: 'Trajectories of one leg', flash: memory.trajectories_of_a_leg, ram: null },
    { name: 'Controller state', flash: null, ram: memory.remembered },
    {
      name: 'Total',
      flash: memory.tables + memory.trajectories_of_a_leg,
      ram: memory.remembered,
    },
    { name: `${memory.processor} capacity`, flash: memory.flash, ram: memory.ram },
  ]
  return (
    <>
      <Table
        caption="Memory of a leg's microcontroller"
        rows={rows}
        rowKey={({ name }) => name}
        columns={[
          { key: 'name', label: 'Per leg', header: true, cell: ({ name }) => name },
          memoryColumn('flash', 'Flash', memory.flash),
          memoryColumn('ram', 'RAM', memory.ram),
        ]}
      />
      <p>
        {memory.fits ? 'Controller and tables fit; ' : 'Does not fit. '}
        {memory.remarks.length > 0
          ? memory.remarks.join(' ')
          : 'so do the trajectories of one leg in all scenarios.'}{' '}
        <span class="muted small">
          The thesis’s microcontroller has {formatCount(Math.round(memory.flash / 1024))}&nbsp;kB of
          flash, {formatCount(Math.round(memory.ram / 1024))}&nbsp;kB of RAM and{' '}
          {formatCount(memory.cycles)} cycles per sample of three joints. The table does not include
          the code.
        </span>
      </p>
      {difference && (
        <p data-table-difference>
          With this smaller table, simulations differ from those with the default one by at most{' '}
          {Object.entries(difference)
            .map(([name, share]) => `${percent(share, 2)} in ${inWords(name)}`)
            .join(', ')}
          .
        </p>
      )}
    </>
  )
}

function memoryColumn(key: 'flash' | 'ram', label: string, limit: number) {
  return {
    key,
    label,
    numeric: true,
    cell: (row: MemoryRow) => {
      const bytes = row[key]
      if (bytes === null) return NONE
      return (
        <>
          {quantity(bytes, 'B', 1)}
          {bytes < limit && <span class="muted small"> ({percent(bytes / limit, 2)})</span>}
        </>
      )
    },
  }
}

function Contents({ firmware }: { firmware: Firmware }) {
  const walks = new Map(firmware.walks.map((walk) => [walk.scenario, walk]))
  return (
    <section class="card" aria-labelledby="firmware-walks">
      <h2 id="firmware-walks">Trajectories and simulations</h2>
      <Table
        caption="Trajectories and simulations by scenario"
        rows={firmware.trajectories}
        rowKey={({ scenario }) => scenario}
        columns={[
          { key: 'scenario', label: 'Scenario', header: true, value: ({ scenario }) => scenario },
          { key: 'rows', label: 'Rows', numeric: true, value: ({ rows }) => rows },
          {
            key: 'leg',
            label: 'One leg',
            unit: 'B',
            numeric: true,
            value: (row) => row.bytes_of_a_leg,
            cell: (row) => formatCount(row.bytes_of_a_leg),
          },
          {
            key: 'bytes',
            label: 'All joints',
            unit: 'B',
            numeric: true,
            minor: true,
            value: ({ bytes }) => bytes,
            cell: ({ bytes }) => formatCount(bytes),
          },
          {
            key: 'samples',
            label: 'Samples compared',
            numeric: true,
            value: ({ scenario }) => walks.get(scenario)?.samples ?? null,
            cell: ({ scenario }) => formatCount(walks.get(scenario)?.samples),
          },
          {
            key: 'status',
            label: 'Status',
            value: ({ scenario }) => walks.get(scenario)?.status ?? null,
          },
        ]}
      />
      <p class="muted small table-note">
        {formatCount(firmware.samples)} samples compared in total,{' '}
        {formatCount(Object.keys(firmware.files).length)} files,{' '}
        {formatNumber(total(firmware) / 1e6, 2)}&nbsp;MB.
      </p>
    </section>
  )
}

function total({ files }: Firmware): number {
  return Object.values(files).reduce((sum, size) => sum + size, 0)
}
