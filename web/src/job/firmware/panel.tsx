/** Firmware of the best design: memory use, contents and download. */

import { useState } from 'preact/hooks'
import { get, url } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Firmware, Job } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { CopyBlock } from '../../components/copy-button'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatNumber, NONE, percent, quantity } from '../../format/number'
import { inWords } from '../../format/words'

/** Index bits of a fuzzy table, for angle error and current. */
const TABLE_BITS = ['10x6', '9x6', '8x6', '8x5']
const [USUAL_BITS] = TABLE_BITS

export default function FirmwarePanel({ job }: { job: Job }) {
  const [bits, setBits] = useState(USUAL_BITS)
  const query = { table_bits: bits === USUAL_BITS ? undefined : bits }
  const exists = job.best_fitness !== null
  const summary = useResource(exists ? `${job.id} ${job.best_iteration} ${bits}` : null, (signal) =>
    get('/v1/jobs/{job_id}/firmware/summary', { path: { job_id: job.id }, query, signal }),
  )
  if (!exists) {
    return (
      <EmptyCard title="No firmware yet">
        Firmware is available once a design has walked in every scenario.
      </EmptyCard>
    )
  }
  const firmware = summary.data
  const hasTables = firmware === null || firmware.tables.length > 0
  return (
    <div class="stack">
      <Card
        title="Firmware of the winner"
        data={{ 'data-fits': firmware?.memory.fits ?? '' }}
        tools={
          <span class="row">
            {hasTables && (
              <Select
                label="Fuzzy table"
                value={bits}
                options={TABLE_BITS.map(
                  (size) => [size, `${size.replace('x', ' × ')} bits`] as const,
                )}
                onChoose={setBits}
              />
            )}
            <a
              class="button primary compact"
              href={url('/v1/jobs/{job_id}/firmware', { job_id: job.id }, query)}
              download={`${job.id}-firmware.zip`}
            >
              Download
            </a>
          </span>
        }
      >
        <div class="stack">
          <p class="muted small">
            C99 source for the microcontroller of one leg, without floating point, with a test that
            replays the winner’s simulations sample by sample:
          </p>
          <CopyBlock
            label="the test"
            text={`unzip ${job.id}-firmware.zip -d firmware && make -C firmware test`}
          />
          <Loaded
            resource={summary}
            what="the firmware; simulating the winner for its test"
            failed="Could not generate the firmware."
          >
            {(data) => <Memory firmware={data} />}
          </Loaded>
        </div>
      </Card>
      {firmware && <Contents firmware={firmware} />}
      <Card
        title="Joint angles for servos"
        tools={
          <a
            class="button compact"
            href={url('/v1/jobs/{job_id}/trajectories', { job_id: job.id })}
            download={`${job.id}-trajectories.zip`}
          >
            Download angles
          </a>
        }
      >
        <p class="muted small">
          For position-controlled servos: start, one cycle and stop of every scenario, as CSV of 50
          rows a second and as ROS 2 JointTrajectory. Compare speeds.csv with the motors.
        </p>
      </Card>
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
        columns={[
          { key: 'per leg', header: true, cell: ({ name }) => name },
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

function memoryColumn(key: 'flash' | 'ram', label: string, limit: number): Column<MemoryRow> {
  return {
    key,
    label,
    numeric: true,
    cell: (row) => {
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

function Contents({ firmware: { walks, trajectories, samples, files } }: { firmware: Firmware }) {
  const walkOf = (scenario: string) => walks.find((walk) => walk.scenario === scenario)
  const size = Object.values(files).reduce((sum, bytes) => sum + bytes, 0)
  return (
    <Card title="Trajectories and simulations">
      <Table<Firmware['trajectories'][number]>
        caption="Trajectories and simulations by scenario"
        rows={trajectories}
        columns={[
          { key: 'scenario', header: true, value: ({ scenario }) => scenario },
          { key: 'rows', numeric: true, value: ({ rows }) => rows },
          { key: 'one leg', unit: 'B', digits: 1, value: (row) => row.bytes_of_a_leg },
          { key: 'all joints', unit: 'B', digits: 1, minor: true, value: ({ bytes }) => bytes },
          {
            key: 'samples compared',
            digits: 1,
            value: ({ scenario }) => walkOf(scenario)?.samples ?? null,
          },
          { key: 'status', value: ({ scenario }) => walkOf(scenario)?.status ?? null },
        ]}
      />
      <p class="muted small table-note">
        {formatCount(samples)} samples compared in total, {formatCount(Object.keys(files).length)}{' '}
        files, {formatNumber(size / 1e6, 2)}&nbsp;MB.
      </p>
    </Card>
  )
}
