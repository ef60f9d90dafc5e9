/** Spec of a job, commands to run it again, evidence and provenance. */

import { useState } from 'preact/hooks'
import { get, post, url } from '../../api/client'
import { useCommand, useResource } from '../../api/resource'
import type { HistoryVerification, Job } from '../../api/types'
import { Card } from '../../components/card'
import { CopyBlock, CopyButton } from '../../components/copy-button'
import { ErrorNotice } from '../../components/feedback'
import { Table } from '../../components/table/table'
import { formatCount } from '../../format/number'
import { type Design, formatExactValue } from '../../format/value'
import { inWords, sentence } from '../../format/words'
import { withQuery } from '../../router/routes'
import { methodNamed, settingText, settingTexts } from '../../submission/draft/settings'
import { startDesigns } from '../facts'

export default function ReproducePanel({ job }: { job: Job }) {
  return (
    <div class="stack">
      <Card
        title="Run this job again"
        tools={
          <a class="button compact" href={withQuery('/jobs/new', { clone: job.id })}>
            Clone in the form
          </a>
        }
      >
        <div class="stack">
          <p class="muted small">
            The same spec with the same seed yields the same designs, bit for bit, if the provenance
            below is the same.
          </p>
          <div class="stack-tight">
            <h3>With the command line</h3>
            <CopyBlock label="the command" text={submitCommand(job.spec)} />
          </div>
          <div class="stack-tight">
            <h3>With curl</h3>
            <CopyBlock label="the curl command" text={curlCommand(job.spec)} />
          </div>
        </div>
      </Card>
      {job.iterations > 0 && <EvidenceCard job={job} />}
      <OptimizerCard job={job} />
      <StartCard designs={startDesigns(job)} />
      <ProvenanceCard job={job} />
      <Card title="Spec as JSON">
        <CopyBlock label="the spec" text={JSON.stringify(job.spec, null, 2)} />
      </Card>
    </div>
  )
}

function submitCommand(spec: object): string {
  const file = `cat > job.json <<'END'\n${JSON.stringify(spec, null, 1)}\nEND`
  return `${file}\ngaitswarm submit --spec job.json --server ${location.origin}`
}

function curlCommand(spec: object): string {
  const quoted = `'${JSON.stringify(spec).replaceAll("'", `'\\''`)}'`
  return `curl -s -X POST ${location.origin}/v1/jobs -H 'Content-Type: application/json' -d ${quoted}`
}

function EvidenceCard({ job: { id } }: { job: Job }) {
  return (
    <Card
      title="Evidence"
      tools={
        <a
          class="button compact"
          href={url('/v1/jobs/{job_id}/evidence', { job_id: id })}
          download={`${id}.zip`}
        >
          Download
        </a>
      }
    >
      <div class="stack">
        <p class="muted small">
          One file with spec, robot, provenance and every evaluation. It can be verified anywhere,
          bit for bit.
        </p>
        <CopyBlock label="the verification" text={`gaitswarm verify ${id}.zip --replay 50`} />
      </div>
    </Card>
  )
}

function OptimizerCard({ job: { optimizer, spec } }: { job: Job }) {
  const catalogue = useResource('optimizers', (signal) => get('/v1/optimizers', { signal }))
  const method = methodNamed(catalogue.data?.items ?? [], optimizer ?? '')
  const defaults = new Map<string, unknown>(Object.entries(method?.settings ?? {}))
  const settings = settingTexts(typeof spec.optimizer === 'object' ? spec.optimizer : {})
  const rows = Object.entries(settings)
    .filter(([name]) => name !== 'name')
    .map(([name, value]) => {
      const usual = method ? settingText(defaults.get(name)) : value
      return { name, value, usual, changed: usual !== value }
    })
  return (
    <Card title={<>Search method: {optimizer}</>}>
      <div class="stack-tight">
        {method && <p class="muted small">{sentence(method.description)}</p>}
        <Table<(typeof rows)[number]>
          caption="Settings of the search method"
          rows={rows}
          rowData={({ name, changed }) => ({
            'data-setting': name,
            'data-changed': String(changed),
          })}
          columns={[
            { key: 'setting', header: true, cell: ({ name }) => inWords(name) },
            {
              key: 'value',
              cell: ({ value, changed }) => (changed ? <strong>{value}</strong> : value),
            },
            {
              key: 'default',
              cell: ({ usual, changed }) =>
                changed ? usual : method && <span class="muted">the same</span>,
            },
          ]}
        />
      </div>
    </Card>
  )
}

function StartCard({ designs }: { designs: readonly Design[] }) {
  if (designs.length === 0) return null
  const names = [...new Set(designs.flatMap((design) => Object.keys(design)))]
  return (
    <Card title="Start designs">
      <p class="muted small">
        {formatCount(designs.length)} given designs that were evaluated first; the search starts
        from them if its method supports it.
      </p>
      <Table<Design>
        caption="Start designs"
        rows={designs}
        pageSize={20}
        columns={[
          { key: 'design', header: true, numeric: true, value: (row) => designs.indexOf(row) },
          ...names.map((name) => ({
            key: name,
            label: name,
            numeric: true,
            value: (row: Design) => row[name] ?? null,
            cell: (row: Design) => formatExactValue(row[name]),
          })),
        ]}
      />
    </Card>
  )
}

function ProvenanceCard({ job }: { job: Job }) {
  return (
    <Card title="Provenance">
      <Table<Job['provenance'][number]>
        caption="Provenance by iteration"
        rows={job.provenance}
        rowData={({ from_iteration }) => ({ 'data-from-iteration': from_iteration })}
        columns={[
          { key: 'from iteration', cell: ({ from_iteration }) => from_iteration },
          { key: 'gaitswarm', label: 'gaitswarm', cell: ({ provenance }) => provenance.gaitswarm },
          {
            key: 'backend',
            cell: ({ provenance: { simulation } }) =>
              `${simulation.backend}, ${simulation.precision}`,
          },
          {
            key: 'robot',
            cell: ({ provenance: { simulation } }) => (
              <>
                {simulation.robot} <Digest digits={simulation.robot_digest} />
              </>
            ),
          },
          {
            key: 'simulation code',
            cell: ({ provenance }) => <Digest digits={provenance.simulation.code_digest} />,
          },
          {
            key: 'search code',
            cell: ({ provenance }) => <Digest digits={provenance.optimizer_digest} />,
          },
          {
            key: 'libraries',
            cell: ({ provenance }) =>
              Object.entries(provenance.simulation.libraries)
                .map(([name, version]) => `${name} ${version}`)
                .join(', '),
          },
        ]}
      />
      {job.head && <HistoryCheck id={job.id} head={job.head} />}
    </Card>
  )
}

function Digest({ digits, shown = 8 }: { digits: string; shown?: number }) {
  return <code title={digits}>{digits.slice(0, shown)}</code>
}

function HistoryCheck({ id, head }: { id: string; head: string }) {
  const [verification, setVerification] = useState<HistoryVerification | null>(null)
  const { busy, error, during } = useCommand()
  const options = { path: { job_id: id }, body: { replay: 0 } }
  const verify = () => during(post('/v1/jobs/{job_id}/verify', options).then(setVerification))
  return (
    <div class="stack-tight" data-head={head}>
      <div class="row">
        <span class="muted small">
          History: head <Digest digits={head} shown={16} />…
        </span>
        <CopyButton text={head} label="the head" />
        <button type="button" class="compact" disabled={busy} onClick={verify}>
          Verify
        </button>
      </div>
      {/* Always present, so that screen readers announce its content. */}
      <p
        class="small"
        role="status"
        data-verified={verification ? String(verification.verified) : undefined}
      >
        {verification && outcome(verification)}
      </p>
      {error !== null && <ErrorNotice what="Could not verify the history." error={error} />}
    </div>
  )
}

function outcome({ verified, checks }: HistoryVerification): string {
  const details = checks.map(({ detail }) => detail).join('; ')
  return verified ? `History verified: ${details}.` : `The history was modified: ${details}.`
}
